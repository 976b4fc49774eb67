"""Mending of cameras' frames around pins, before anything is solved.

around.py  the cameras' joints around some pins, at even instants, with left and right as they are
spread.py  what pins say about a joint's neighbourhood: its path, and the cameras' errors
frames.py  all frames as edits leave them
"""

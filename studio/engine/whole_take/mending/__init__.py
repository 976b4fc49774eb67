"""Mending of cameras' frames around pins, before anything is solved.

around.py    the cameras' joints around some pins, at even instants, with left and right as they are
floor.py     how far the solve will raise the take: pins are on its floor
interval.py  from when to when cameras contradict a pin, and by how much
spread.py    the path of a joint while nothing is known of it but pins
frames.py    all frames as edits leave them
"""

"""Humanoid robots as characters: read, measured, kept, and moved by a performer's poses.

`body` reads a model and measures it, `files` stores robots, `describe` reports their `facts`. `moving` makes a robot
follow a performer, `motion` writes its motion, `figures` judges it, and `comparing` judges every way of moving it.
"""

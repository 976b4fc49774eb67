"""Humanoid robots as characters: read, measured, kept, and moved by a performer's poses.

`body` reads a model and measures it, `files` keeps robots, `describe` tells `facts` of them. `moving` has one follow
a performer, `motion` writes its motion, `figures` judges it, `comparing` does so for every way of moving it.
"""

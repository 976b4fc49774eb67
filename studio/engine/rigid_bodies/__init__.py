"""Rigid bodies that another system tracks: their motion over a take, their shapes, and their use with a performer.

`reading` has the incoming data and their axes, `tracks` the motion of each body over time, `known` an operator's
knowledge of them, `tie` the place of the other system and of bodies on joints, `pins` bodies as evidence of a solve,
and `props` bodies as objects that are held and exported.
"""

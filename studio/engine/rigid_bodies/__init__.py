"""Rigid bodies that another system tracks: their motion over a take, their shapes, and how they go with a performer.

`reading` has what comes in and its axes, `tracks` the motion of each over time, `known` what an operator says of
them, `tie` where the other system stands and how a body sits on a joint, `pins` bodies as evidence of a solve, and
`props` bodies as things that are held and exported.
"""

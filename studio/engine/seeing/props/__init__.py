"""Props in depth images: a box, cylinder or ball of known size is found and followed by its shape.

`solid` has the shapes, `sight` what cameras see at an instant apart from the performers, `fit` the pose that explains
it, `find` the first pose, and `follow` the motion over a take.
"""

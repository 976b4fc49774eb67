"""Seeing (step 1): from depth images to skeletons, hand states and head orientation.

A frame passes `images` (points), `fitting` (a body fitted to points), `search` (recovery of a lost body or limb)
and `tracker`, which runs them; `hands` and `head` use small windows of the image. `cameras` places cameras by what
all of them see. `observer` runs all of it for one camera.
"""

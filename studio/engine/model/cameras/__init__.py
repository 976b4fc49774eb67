"""Cameras: lenses, depth images and their errors.

`lens` turns pixels into rays and back, `depth` describes depth images and their cameras, `joint_noise` gives the
usual error of a depth camera's joints, and `observation` holds what a camera client finds in one depth image.

In: the lens of a camera, pixels, depth images. Out: rays, points and expected errors in the camera frame.
"""

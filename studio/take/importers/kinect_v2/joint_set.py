"""Axes and joint set of the Kinect v2 kinds.

The Kinect v2 writes x to the sensor's left, y up, z away from it (right-handed). A half turn about z gives
the camera frame of the engine: x right, y down, z forward. Left and right joints keep their sides: those of a
person who faces the sensor.
"""

import numpy as np
from numpy.typing import NDArray

JOINT_SET = "kinect-v2"
DEVICE = "Kinect v2"
TICK_NS = 100
"""One tick of the device clock [ns]."""

R_CAMERA_KINECT: NDArray[np.float64] = np.diag([-1.0, -1.0, 1.0])
"""Kinect axes -> camera frame (OpenCV); a rotation, determinant +1."""


def to_camera(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points in Kinect axes, shape (..., 3) [m], in the camera frame."""
    return points @ R_CAMERA_KINECT.T

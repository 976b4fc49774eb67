"""Directions of heads, as evidence of the body's heading."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.seeing.head import head_arrows
from studio.engine.seeing.tracker.view import CameraView

Array = NDArray[np.float64]


class Heads:
    """The heads in the images of one instant.

    Args:
        views: the cameras by name.
        frames: their images, at most one of each.
    """

    def __init__(self, views: dict[str, CameraView], frames: dict[str, DepthFrame]) -> None:
        self._views, self._frames = views, frames

    def face(self, head: Array) -> Array:
        """Return a head's horizontal direction in the working frame, shape (2,), shorter = less certain, from the
        most certain camera.

        Args:
            head: the joint of the head in the working frame [m], shape (3,).
        """
        told = [np.zeros(2)]
        for name, frame in self._frames.items():
            T = self._views[name].T_work_camera
            assert T is not None
            place = transform_points(invert_transform(T), head)
            arrows = head_arrows(self._views[name].camera, frame.depth_mm, place)
            if arrows is not None:
                face = T[:3, :3] @ arrows[0]
                told.append(face[:2] / max(float(np.linalg.norm(face)), 1.0))
        return max(told, key=lambda face: float(np.hypot(face[0], face[1])))

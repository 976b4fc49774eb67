"""Where heads face, as evidence of where a body does."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.depth import DepthFrame
from studio.engine.geometry import invert_transform, transform_points
from studio.engine.head import head_arrows
from studio.engine.tracker.view import CameraView

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
        """Return where a head faces, horizontally, in the working frame, shape (2,): the shorter the less sure. The
        camera that is surest has its say.

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
        return max(told, key=lambda face: float(np.hypot(*face)))

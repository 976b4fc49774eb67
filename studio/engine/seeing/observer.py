"""Observation of one camera's depth images in the camera client (step 1): skeleton, hand states, head orientation."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.depth import DepthCamera, DepthFrame
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.observation import Observation
from studio.engine.seeing.hands.states import HandStates
from studio.engine.seeing.head import HeadTracker
from studio.engine.seeing.tracker.tracker import Tracker


class Observer:
    """Tracks one performer through one camera's depth images.

    Args:
        name: of the camera.
        camera: its intrinsics.
    """

    def __init__(self, name: str, camera: DepthCamera) -> None:
        self._name, self._camera = name, camera
        self._tracker = Tracker({name: camera})
        self._hands = HandStates(camera)
        self._head = HeadTracker(camera)
        self._sequence = 0

    def observe(self, time_ns: int, depth_mm: NDArray[np.uint16]) -> Observation:
        """Return the observation of an image; images come in order of time."""
        frame = DepthFrame(self._name, self._sequence, time_ns, depth_mm)
        self._sequence += 1
        skeleton = self._tracker.track({self._name: frame})
        if skeleton.status != "tracked" or not np.isfinite(skeleton.positions).any():
            nobody = np.full((JOINT_COUNT, 3), np.nan)
            return Observation(time_ns, nobody, np.zeros(JOINT_COUNT), status=skeleton.status)
        hands = self._hands.update(depth_mm, skeleton.positions, skeleton.confidence, time_ns)
        head = self._head.update(depth_mm, skeleton.positions, skeleton.confidence, time_ns)
        wxyz = None if head is None else head.wxyz
        return Observation(time_ns, skeleton.positions, skeleton.confidence, hands, wxyz, skeleton.status)

"""Observation of one camera's depth images in the camera client (step 1): skeletons, hand states, heads."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import say
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.cameras.observation import Observation
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.seeing.hands.states import HandStates
from studio.engine.seeing.head import HeadTracker
from studio.engine.seeing.tracker.tracked import TrackedSkeleton
from studio.engine.seeing.tracker.tracker import Tracker

_LEGS = {
    "": "",
    "range": say("camera.legs_range", "the legs are out of its range and hang as usual: step nearer"),
    "no_depth": say(
        "camera.legs_no_depth",
        "the legs give it no depth and hang as usual: dark or shiny clothes do so, wear others",
    ),
    "covered": say(
        "camera.legs_covered", "something hides the legs, which hang as usual: move it or the camera"
    ),
    "outside": say(
        "camera.legs_outside",
        "the legs are outside its picture and hang as usual: tilt it down, or step back",
    ),
}
"""Messages about legs that the camera does not show; see `TrackedSkeleton.legs_unread`."""


class _Details:
    """Hands and head of one body."""

    def __init__(self, camera: DepthCamera) -> None:
        self.hands, self.head = HandStates(camera), HeadTracker(camera)


class Observer:
    """Tracks performers through one camera's depth images.

    Args:
        name: of the camera.
        camera: its intrinsics.
    """

    def __init__(self, name: str, camera: DepthCamera) -> None:
        self._name, self._camera = name, camera
        self._tracker = Tracker({name: camera})
        self._details = {0: _Details(camera)}
        self._sequence = 0

    def observe(self, time_ns: int, depth_mm: NDArray[np.uint16]) -> Observation:
        """Return the observation of an image; images come in order of time."""
        frame = DepthFrame(self._name, self._sequence, time_ns, depth_mm)
        self._sequence += 1
        skeleton = self._tracker.track({self._name: frame})
        if skeleton.status != "tracked" or not np.isfinite(skeleton.positions).any():
            nobody = np.full((JOINT_COUNT, 3), np.nan)
            return Observation(time_ns, nobody, np.zeros(JOINT_COUNT), status=skeleton.status)
        first, *others = (self._observed(one, depth_mm, time_ns) for one in skeleton.each())
        return replace(first, others=tuple(others)) if others else first

    def _observed(self, skeleton: TrackedSkeleton, depth_mm: NDArray[np.uint16], time_ns: int) -> Observation:
        seen = self._details.get(skeleton.body)
        if seen is None:
            seen = self._details[skeleton.body] = _Details(self._camera)
        hands = seen.hands.update(depth_mm, skeleton.positions, skeleton.confidence, time_ns)
        head = seen.head.update(depth_mm, skeleton.positions, skeleton.confidence, time_ns)
        wxyz = None if head is None else head.wxyz
        problem = _LEGS[skeleton.legs_unread.get(self._name, "")]
        return Observation(
            time_ns,
            skeleton.positions,
            skeleton.confidence,
            hands,
            wxyz,
            skeleton.status,
            problem,
            skeleton.body,
        )

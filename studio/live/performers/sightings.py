"""Which camera sees whom: nobody on a stage of several is lost silently."""

from collections import deque

import numpy as np

from studio.engine.identity.recognised import Recognised
from studio.engine.model.frames import CameraFrame

LOOK_S = 1.5
_GHOST_SHARE = 0.5
"""Share of frames with bodies of nobody above which a camera shows a ghost: newcomers are known sooner."""

_LEAST_FRAMES = 10

_Seen = tuple[int, frozenset[int], int]
"""Arrival of a frame [ns], the performers in it, and the number of its bodies that are nobody's."""


def _shows_anybody(body: CameraFrame) -> bool:
    return bool(np.isfinite(body.positions[:, 0]).any())


class Sightings:
    """What cameras showed in the last moments; all methods belong to the engine thread."""

    def __init__(self) -> None:
        self._frames: dict[str, deque[_Seen]] = {}

    def add(self, frame: CameraFrame, recognised: list[Recognised], now_ns: int) -> None:
        """Add a camera's frame, and its recognised bodies."""
        performers = frozenset(one.performer for one in recognised if one.performer is not None)
        bodies = 1 if recognised and not frame.others else sum(map(_shows_anybody, frame.bodies()))
        frames = self._frames.setdefault(frame.camera, deque())
        frames.append((now_ns, performers, bodies - len(recognised)))
        self._forget(frames, now_ns)

    def unseen_by(self, performer: int, now_ns: int) -> list[str]:
        """Return the cameras that send frames and did not show a performer, by number, at all."""
        return [
            name
            for name, frames in self._recent(now_ns).items()
            if not any(performer in seen for _, seen, _ in frames)
        ]

    def ghosts(self, now_ns: int) -> list[str]:
        """Return the cameras that keep showing a body that is nobody's."""
        return [
            name
            for name, frames in self._recent(now_ns).items()
            if sum(ghosts > 0 for *_, ghosts in frames) > _GHOST_SHARE * len(frames)
        ]

    def _recent(self, now_ns: int) -> dict[str, deque[_Seen]]:
        for frames in self._frames.values():
            self._forget(frames, now_ns)
        return {name: frames for name, frames in self._frames.items() if len(frames) >= _LEAST_FRAMES}

    @staticmethod
    def _forget(frames: deque[_Seen], now_ns: int) -> None:
        while frames and now_ns - frames[0][0] > LOOK_S * 1e9:
            frames.popleft()

"""The finished parts of solves that are still being made, kept in memory until the solve ends."""

import threading
from dataclasses import dataclass, replace

import numpy as np

from studio.engine.model.poses import Poses, on_output_joints
from studio.offline.so_far import SoFar
from studio.take.folder.take import Take
from studio.web.playback.clip import Clip


@dataclass(frozen=True)
class GrowingClip(Clip):
    """The beginning of a solve that is being made; `of_s`: length of the whole solve [s]."""

    of_s: float = 0.0


class GrowingClips:
    """The solves that are being made, by take and name; all methods may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._clips: dict[tuple[str, str], GrowingClip] = {}

    def find(self, take: str, solve: str) -> GrowingClip | None:
        """Return a solve's parts so far; None if there are none."""
        with self._lock:
            return self._clips.get((take, solve))

    def add(self, take: Take, solve: str, so_far: SoFar) -> GrowingClip:
        """Add the next part; return all parts so far."""
        id_ = f"{take.path.parent.name}/{take.path.name}"
        part = on_output_joints(so_far.poses)
        with self._lock:
            before = self._clips.get((id_, solve))
            if before is None:
                before = GrowingClip.of(take, solve, part)
            poses = part if so_far.begins else _joined(before.poses, part)
            clip = replace(before, poses=poses, of_s=so_far.of_s)
            self._clips[id_, solve] = clip
        return clip

    def end(self, take: str, solve: str) -> None:
        """Remove a solve that is finished or was given up."""
        with self._lock:
            self._clips.pop((take, solve), None)


def _joined(first: Poses, then: Poses) -> Poses:
    names = ("time_s", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    return replace(
        first, **{name: np.concatenate([getattr(first, name), getattr(then, name)]) for name in names}
    )

"""A motion: a skeleton in its file's own joints (`Motion`), and the same in canonical joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

END = ":end"
"""Suffix of a BVH End Site's name, after the name of its parent."""


@dataclass(frozen=True)
class Motion:
    """A skeleton's motion in its file's own joints, in the stage frame (metres, z up).

    Attributes:
        frame_s: time between frames [s].
        joint_names: as in the file; an End Site is named `<parent>:end`; shape (joint_count,).
        parents: index of each joint's parent, -1 for the root; a parent comes before its children.
        positions_m: joint positions, shape (frame_count, joint_count, 3).
        rotations: world rotations from the rest pose, shape (frame_count, joint_count, 3, 3).
        rest_m: joint positions of the rest pose (all rotations zero), the root at its own offset,
            shape (joint_count, 3).
    """

    frame_s: float
    joint_names: tuple[str, ...]
    parents: NDArray[np.int64]
    positions_m: NDArray[np.float64]
    rotations: NDArray[np.float64]
    rest_m: NDArray[np.float64]

    @property
    def frame_count(self) -> int:
        return len(self.positions_m)


@dataclass(frozen=True)
class CanonicalMotion:
    """A motion of the canonical joints (`joints.CANONICAL`) in the stage frame.

    Attributes:
        frame_s: time between frames [s]; the first frame is at time 0.
        positions_m: joint centres, shape (frame_count, 21, 3).
        offsets_m: the body in the T-pose: each joint minus its parent, stage axes, shape (21, 3); the row of
            the hips is their height above the floor.
        hands_open: 1 = open, 0 = fist, left then right, shape (frame_count, 2).
    """

    frame_s: float
    positions_m: NDArray[np.float64]
    offsets_m: NDArray[np.float64]
    hands_open: NDArray[np.float64]

    @property
    def frame_count(self) -> int:
        return len(self.positions_m)

    @property
    def duration_s(self) -> float:
        """Time of the last frame [s]."""
        return (self.frame_count - 1) * self.frame_s

    def times_s(self) -> NDArray[np.float64]:
        """Return the time of each frame [s], shape (frame_count,)."""
        return np.arange(self.frame_count, dtype=np.float64) * self.frame_s

    def at(self, time_s: float) -> NDArray[np.float64]:
        """Return the joints at one time [m], shape (21, 3): linear between frames, held at both ends."""
        place = min(max(time_s / self.frame_s, 0.0), self.frame_count - 1.0)
        first = int(place)
        share, after = place - first, min(first + 1, self.frame_count - 1)
        return (1 - share) * self.positions_m[first] + share * self.positions_m[after]

    def hands_open_at(self, time_s: float) -> tuple[float, float]:
        """Return the openness of the left and the right hand in the frame nearest to one time."""
        index = min(max(round(time_s / self.frame_s), 0), self.frame_count - 1)
        left, right = self.hands_open[index]
        return float(left), float(right)

"""Distances between two motions, over time and by joint, for choosing one of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.engine.metrics.results import Apart, DifferenceSummary
from studio.engine.model.joints import CANONICAL
from studio.engine.model.poses import Poses

WORST_APART_S = 0.5
"""Shortest time between two listed instants."""


@dataclass(frozen=True)
class Differences:
    """Distances between a solve and another motion at the solve's instants.

    Attributes:
        frames: indices of the solve's frames with at least one joint known in both, shape (frame_count,).
        time_s: their stage times [s], shape (frame_count,).
        joints: canonical joints that both have.
        mm: distance [mm], shape (frame_count, len(joints)); NaN where the joint is unknown in the other motion.
    """

    frames: NDArray[np.int64]
    time_s: NDArray[np.float64]
    joints: tuple[str, ...]
    mm: NDArray[np.float64]

    def summary(self, *, worst: int = 10) -> DifferenceSummary:
        """Return mean, percentile and maximum of the distances, with the `worst` instants."""
        return DifferenceSummary(
            frames=len(self.time_s),
            mean_mm=float(np.nanmean(self.mm)),
            p95_mm=float(np.nanpercentile(self.mm, 95)),
            max_mm=float(np.nanmax(self.mm)),
            per_joint_mm={name: float(np.nanmean(self.mm[:, j])) for j, name in enumerate(self.joints)},
            worst=self._worst(worst),
        )

    def _worst(self, count: int) -> list[Apart]:
        found: list[Apart] = []
        largest = np.nanmax(np.nan_to_num(self.mm, nan=-1.0), axis=1)
        for i in np.argsort(largest)[::-1]:
            if len(found) == count:
                break
            if all(abs(self.time_s[i] - other.time_s) >= WORST_APART_S for other in found):
                joint = int(np.nanargmax(np.nan_to_num(self.mm[i], nan=-1.0)))
                found.append(Apart(float(self.time_s[i]), self.joints[joint], float(self.mm[i, joint])))
        return found


def differences(poses: Poses, other: Reference) -> Differences:
    """Return the distances of a solve from another motion in the stage frame and on the stage clock.

    Raises:
        FormatError: no instant or no joint in common.
    """
    inside = (poses.time_s >= other.time_s[0] - 1e-9) & (poses.time_s <= other.time_s[-1] + 1e-9)
    if not inside.any():
        raise FormatError(
            "compare.no_instant", "the two motions have no instant in common; move one of them in time"
        )
    frames = np.flatnonzero(inside)
    time_s = poses.time_s[frames]
    at = other.at(np.clip(time_s, other.time_s[0], other.time_s[-1]))
    mm = np.linalg.norm(canonical_positions(poses)[frames] - at, axis=2) * 1e3
    known, told = np.flatnonzero(np.isfinite(mm).any(axis=0)), np.isfinite(mm).any(axis=1)
    if len(known) == 0:
        raise FormatError("compare.no_joint", "the two motions have no joint in common; choose others")
    joints = tuple(CANONICAL[j] for j in known)
    return Differences(frames[told], time_s[told], joints, mm[np.ix_(told, known)])


def compare(a: Poses, b: Poses, *, worst: int = 10) -> DifferenceSummary:
    """Return the distances between two solves of a take at their common instants.

    Args:
        a, b: solves in the same stage frame, on the same clock.
        worst: number of listed instants, at least half a second apart.

    Raises:
        FormatError: no instant or no joint in common.
    """
    return differences(a, Reference(b.time_s, canonical_positions(b))).summary(worst=worst)

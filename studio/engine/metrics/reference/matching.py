"""A solve and a reference at the same joints and the same instants."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.metrics.reference.canonical import canonical_columns, of_canonical
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import INDEX, MEASURED_JOINTS, PARENT_OF_CANONICAL
from studio.engine.model.poses import Poses


@dataclass(frozen=True)
class Matched:
    """A solve and a reference at the solve's instants, both in canonical joints [m].

    Attributes:
        time_s: the solve's times [s] inside the overlap, shape (frame_count,).
        solve_m: shape (frame_count, 21, 3); NaN = the solve lacks the joint.
        reference_m: shape (frame_count, 21, 3); NaN = unknown then.
        seen: whether the solve saw the joint then, shape (frame_count, 21).
        radius_mm: the solve's own 90 % ball around each joint, shape (frame_count, 21); NaN = unknown.
        bone_lengths_m: the solve's own bones (`bones_of`), shape (frame_count, bone_count).
    """

    time_s: NDArray[np.float64]
    solve_m: NDArray[np.float64]
    reference_m: NDArray[np.float64]
    seen: NDArray[np.bool_]
    radius_mm: NDArray[np.float64]
    bone_lengths_m: NDArray[np.float64]

    @property
    def rate_hz(self) -> float:
        """Frame rate of the solve, by the median step."""
        return float(1.0 / np.median(np.diff(self.time_s)))

    @property
    def joints(self) -> list[str]:
        """The measured joints that both have, in the order of `MEASURED_JOINTS`."""
        return [name for name in MEASURED_JOINTS if self.has(name)]

    def has(self, *names: str) -> bool:
        """Whether both have every one of these canonical joints at some instant."""
        return all(self._common[INDEX[name]] for name in names)

    @cached_property
    def _common(self) -> NDArray[np.bool_]:
        """Return whether both have each canonical joint at some instant, shape (21,)."""
        return np.any(np.isfinite(self.solve_m + self.reference_m).all(axis=2), axis=0)

    def columns(self, names: list[str]) -> list[int]:
        """Indices of these canonical joints in the arrays."""
        return [INDEX[name] for name in names]

    def pick(self, names: list[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return these joints of solve and reference, each of shape (frame_count, len(names), 3)."""
        index = self.columns(names)
        return self.solve_m[:, index], self.reference_m[:, index]


def bones_of(poses: Poses) -> NDArray[np.int64]:
    """Return the (joint, parent) pairs, shape (bone_count, 2), that carry a canonical joint.

    Fingers other than the base of the middle one carry none and are left out. Poses without a
    hierarchy have the canonical one.
    """
    columns, parents = canonical_columns(poses), poses.parents
    if (parents < 0).all():
        pairs = [(columns[INDEX[a]], columns[INDEX[b]]) for a, b in PARENT_OF_CANONICAL.items()]
        return np.array([pair for pair in pairs if min(pair) >= 0], dtype=np.int64).reshape(-1, 2)
    carrying = np.zeros(len(parents), dtype=bool)
    carrying[columns[columns >= 0]] = True
    for joint in range(len(parents) - 1, 0, -1):  # parents come before children
        if carrying[joint] and parents[joint] >= 0:
            carrying[parents[joint]] = True
    joints = np.flatnonzero(carrying & (parents >= 0))
    return np.stack([joints, parents[joints]], axis=1)


def match(
    poses: Poses,
    reference: Reference,
    *,
    start_s: float | None = None,
    offset_s: float = 0.0,
    drift_ppm: float = 0.0,
) -> Matched:
    """Return solve and reference at the solve's instants inside the overlap.

    Args:
        poses: the solve.
        reference: the reference.
        start_s: stage time before which nothing is compared (the calibration part of a take).
        offset_s: offset of the reference's clock from the stage clock at stage time 0, positive = ahead.
        drift_ppm: its drift, positive = faster.

    Raises:
        FormatError: fewer than 4 common instants, or fewer than 3 common joints.
    """
    reference_time = poses.time_s + offset_s + drift_ppm * 1e-6 * poses.time_s
    keep = (reference_time >= reference.time_s[0]) & (reference_time <= reference.time_s[-1])
    if start_s is not None:
        keep &= poses.time_s >= start_s
    if keep.sum() < 4:
        solved = f"{poses.time_s[0]:.2f} to {poses.time_s[-1]:.2f} s" if poses.frame_count else "no frame"
        since = "" if start_s is None else f", compared from {start_s:.2f} s"
        raise FormatError(
            "reference.few_instants_in_common",
            "the solve ({solve}) and the reference ({start:.2f} to {end:.2f} s) share fewer than "
            "4 instants; is it the reference of this take?",
            solve=f"{solved}{since}",
            start=reference.time_s[0],
            end=reference.time_s[-1],
        )
    columns, positions = canonical_columns(poses), poses.positions_m[keep]
    child, parent = bones_of(poses).T
    matched = Matched(
        time_s=poses.time_s[keep],
        solve_m=of_canonical(positions, columns, np.nan),
        reference_m=reference.at(reference_time[keep]),
        seen=of_canonical(poses.confidence[keep], columns, 0.0) > 0,
        radius_mm=of_canonical(poses.uncertainty_mm[keep], columns, np.nan),
        bone_lengths_m=np.linalg.norm(positions[:, child] - positions[:, parent], axis=2),
    )
    if len(matched.joints) < 3:
        raise FormatError(
            "reference.few_joints_in_common",
            "solve and reference share only the joints {names}; at least 3 are needed of {all}",
            names=", ".join(matched.joints) or "(none)",
            all=[*MEASURED_JOINTS],
        )
    return matched

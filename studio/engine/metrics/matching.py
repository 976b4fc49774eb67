"""A solve and a reference brought to the same joints and the same instants."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import FormatError
from studio.engine.joints import CANONICAL, INDEX, JOINT_COUNT, MEASURED_JOINTS, OUTPUT_OF_CANONICAL
from studio.engine.metrics.reference import Reference
from studio.engine.poses import Poses


@dataclass(frozen=True)
class Matched:
    """A solve and a reference at the solve's instants, both in canonical joints [m].

    Attributes:
        time_s: the solve's times [s] inside the overlap, shape (frame_count,).
        solve_m: shape (frame_count, 21, 3); NaN = a joint that the solve lacks altogether.
        reference_m: shape (frame_count, 21, 3); NaN = unknown then.
        seen: whether the solve saw the joint then, shape (frame_count, 21).
    """

    time_s: NDArray[np.float64]
    solve_m: NDArray[np.float64]
    reference_m: NDArray[np.float64]
    seen: NDArray[np.bool_]

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
        """Which canonical joints both have at some instant, shape (21,)."""
        return np.isfinite(self.solve_m + self.reference_m).all(axis=2).any(axis=0)

    def pick(self, names: list[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return these joints of solve and reference, each of shape (frame_count, len(names), 3)."""
        index = [INDEX[name] for name in names]
        return self.solve_m[:, index], self.reference_m[:, index]


def canonical_positions(poses: Poses) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the poses' canonical joints, shape (frame_count, 21, 3), NaN = lacking, and their confidence.

    The poses' joints carry the output skeleton's names, or canonical ones where the take was imported so.
    """
    index = {name: i for i, name in enumerate(poses.joint_names)}
    positions = np.full((poses.frame_count, JOINT_COUNT, 3), np.nan)
    confidence = np.zeros((poses.frame_count, JOINT_COUNT))
    for k, name in enumerate(CANONICAL):
        column = index.get(OUTPUT_OF_CANONICAL[name], index.get(name))
        if column is not None:
            positions[:, k] = poses.positions_m[:, column]
            confidence[:, k] = poses.confidence[:, column]
    return positions, confidence


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
        reference: what it is measured against.
        start_s: stage time before which nothing is compared (the calibration part of a take).
        offset_s: how far the reference's clock is ahead of the stage clock, at stage time 0.
        drift_ppm: how much faster it runs.

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
            f"the solve ({solved}{since}) and the reference "
            f"({reference.time_s[0]:.2f} to {reference.time_s[-1]:.2f} s) share fewer than 4 instants; "
            "is it the reference of this take?"
        )
    positions, confidence = canonical_positions(poses)
    matched = Matched(
        time_s=poses.time_s[keep],
        solve_m=positions[keep],
        reference_m=reference.at(reference_time[keep]),
        seen=confidence[keep] > 0,
    )
    if len(matched.joints) < 3:
        raise FormatError(
            f"solve and reference share only the joints {', '.join(matched.joints) or '(none)'}; "
            f"at least 3 are needed of {', '.join(MEASURED_JOINTS)}"
        )
    return matched

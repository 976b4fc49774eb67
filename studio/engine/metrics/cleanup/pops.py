"""Joint pops: a joint over 5 cm, or its rotation over 40 degrees, off a local cubic, absent in the reference.

The cubic is the one of least squares through the samples up to 0.15 s before and after, without those within
1/30 s: a spike of up to two frames of a 30 Hz camera counts with its whole height, whatever the motion under it,
a step with half of its height. A pop counts if the reference has nothing within 5 cm of it at that joint within
0.1 s; a reference has no rotations, so a turn counts unless the reference itself pops there.
Source: residuals of a local polynomial as in Savitzky and Golay, "Smoothing and differentiation of data by
simplified least squares procedures", Analytical Chemistry 1964, the middle left out.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.joints import CANONICAL
from studio.engine.metrics.cleanup.events import Event, events_of, joined, limb_of
from studio.engine.metrics.cleanup.shown import Shown

POP_M = 0.05
POP_DEG = 40.0
INNER_S = 1 / 30
OUTER_S = 0.15
REFERENCE_S = 0.1


def joint_pops(shown: Shown, reference_m: NDArray[np.float64] | None) -> list[Event]:
    """Return the pops of all joints.

    Args:
        shown: the animation.
        reference_m: canonical joints at the animation's times in the stage frame [m], shape
            (sample_count, 21, 3), NaN = unknown; None without a reference.
    """
    steps, weights = _cubic(shown.step_s)
    off = residual_m(shown.positions_m, steps, weights)
    if reference_m is None:
        beyond = np.linalg.norm(off, axis=2)
        calm = np.ones(off.shape[:2], dtype=bool)
    else:
        reference_off = residual_m(reference_m, steps, weights)
        beyond = _nearest_difference(off, reference_off, shown.frames(REFERENCE_S))
        calm = ~_near(np.linalg.norm(reference_off, axis=2) > POP_M, shown.frames(REFERENCE_S))
    size = np.linalg.norm(off, axis=2) * 100.0
    turned = _turned_deg(shown.rotations, steps, weights)
    events: list[Event] = []
    for j, name in enumerate(CANONICAL):
        flags = (size[:, j] > POP_M * 100) & (beyond[:, j] > POP_M)
        events += events_of("joint_pop", name, shown.time_s, size[:, j], flags, unit="cm")
        flags = (turned[:, j] > POP_DEG) & calm[:, j]
        events += events_of("joint_pop", name, shown.time_s, turned[:, j], flags, unit="deg")
    hips = [event for event in events if event.joint == "hips"]
    return _without_carried(joined(events, lambda event: limb_of(event.joint)), hips)


def _cubic(step_s: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Steps from the middle, and weights with which the samples there give the cubic's value in the middle."""
    steps = np.arange(-round(OUTER_S / step_s), round(OUTER_S / step_s) + 1)
    inner = round(INNER_S / step_s + 1e-9)
    steps = steps[np.abs(steps) > inner] if (np.abs(steps) > inner).sum() >= 4 else steps[steps != 0]
    powers = (steps * step_s)[:, None] ** np.arange(4)
    return steps, np.linalg.pinv(powers)[0]


def residual_m(
    positions_m: NDArray[np.float64], steps: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Positions less their local cubics, shape (sample_count, joint_count, 3); NaN near the ends and gaps."""
    out = np.full(positions_m.shape, np.nan)
    reach = int(steps.max())
    if len(positions_m) <= 2 * reach:
        return out
    middle = positions_m[reach:-reach].copy()
    for step, weight in zip(steps, weights, strict=True):
        middle -= weight * positions_m[reach + step : len(positions_m) - reach + step]
    out[reach:-reach] = middle
    return out


def _nearest_difference(
    off: NDArray[np.float64], reference_off: NDArray[np.float64], reach: int
) -> NDArray[np.float64]:
    """Least distance [m] of each residual to the reference's within `reach` samples; NaN where unknown."""
    best = np.full(off.shape[:2], np.inf)
    for shift in range(-reach, reach + 1):
        there = np.full(off.shape, np.nan)
        if shift >= 0:
            there[: len(off) - shift] = reference_off[shift:]
        else:
            there[-shift:] = reference_off[:shift]
        best = np.fmin(best, np.linalg.norm(off - there, axis=2))
    return np.where(np.isfinite(best), best, np.linalg.norm(off, axis=2))


def _near(flags: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Whether a flag is set within `reach` samples, by column."""
    out = flags.copy()
    for shift in range(1, reach + 1):
        out[shift:] |= flags[:-shift]
        out[:-shift] |= flags[shift:]
    return out


def _turned_deg(
    rotations: NDArray[np.float64], steps: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Angle [deg] between each rotation and the cubic through its neighbours' rotation vectors, (sample_count, 21).

    Vectors are taken from the neighbour nearest before, so that a rotation that is far off spoils none of them.
    Where no neighbour is half of `POP_DEG` away, the angle is left at 0.
    """
    count, joints = rotations.shape[:2]
    out = np.zeros((count, joints))
    reach = int(steps.max())
    if count <= 2 * reach:
        return out
    trace_least = np.full((count - 2 * reach, joints), 3.0)
    for step in steps:
        there = rotations[reach + step : count - reach + step]
        trace_least = np.minimum(trace_least, (rotations[reach : count - reach] * there).sum(axis=(2, 3)))
    suspects = np.argwhere(trace_least < 1.0 + 2.0 * np.cos(np.radians(0.5 * POP_DEG)))
    if not len(suspects):
        return out
    frames, columns = suspects[:, 0] + reach, suspects[:, 1]
    before = Rotation.from_matrix(rotations[frames + steps[steps < 0].max(), columns])
    predicted = np.zeros((len(frames), 3))
    for step, weight in zip(steps, weights, strict=True):
        there = Rotation.from_matrix(rotations[frames + step, columns])
        predicted += weight * (before.inv() * there).as_rotvec()
    middle = Rotation.from_matrix(rotations[frames, columns])
    difference = (before * Rotation.from_rotvec(predicted)).inv() * middle
    out[frames, columns] = np.degrees(difference.magnitude())
    return out


def _without_carried(events: list[Event], hips: list[Event]) -> list[Event]:
    """Return the events without those of limbs while the hips, which carry them, pop as well."""
    return [
        event
        for event in events
        if limb_of(event.joint) == "trunk" or not any(h.start_s <= event.peak_s <= h.end_s for h in hips)
    ]

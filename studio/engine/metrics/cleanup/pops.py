"""Joint pops: a joint over 5 cm, or its rotation over 40 degrees, off a local cubic, absent in the reference.

The cubic is the least-squares fit through the samples up to 0.15 s before and after, without those within
1/30 s. A spike of up to two frames of a 30 Hz camera therefore counts with its whole height, whatever the motion
under it, and a step with half of its height. The reference has the pop too if that joint is half as far off its own
cubic within 0.1 s, so sharp true motion is no pop. A reference has no rotations, so a turn counts unless the
reference's joint itself is over 5 cm off then.
Source: residuals of a local polynomial without its middle samples, as in Savitzky and Golay, "Smoothing and
differentiation of data by simplified least squares procedures", Analytical Chemistry 1964.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial.transform import Rotation

from studio.engine.base.quaternions import multiply
from studio.engine.metrics.cleanup.events import CleanupEvent, events_of, joined, limb_of
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.model.joints import CANONICAL

POP_CM = 5.0
POP_DEG = 40.0
INNER_S = 1 / 30
OUTER_S = 0.15
REFERENCE_S = 0.1


def joint_pops(shown: ShownMotion, reference_m: NDArray[np.float64] | None) -> list[CleanupEvent]:
    """Return the pops of all joints.

    Args:
        shown: the animation.
        reference_m: canonical joints at the animation's times in the stage frame [m], shape
            (sample_count, 21, 3), NaN = unknown; None without a reference.
    """
    steps, weights = _cubic(shown.step_s)
    size = off_course_cm(shown.positions_m, shown.step_s)
    own = np.zeros(size.shape)
    if reference_m is not None:
        off = off_course_cm(reference_m, shown.step_s)
        own = _largest_near(np.nan_to_num(off), shown.frames(REFERENCE_S))
    turned = _turned_deg(shown.rotations, steps, weights)
    events: list[CleanupEvent] = []
    for j, name in enumerate(CANONICAL):
        flags = (size[:, j] > POP_CM) & (own[:, j] < 0.5 * size[:, j])
        events += events_of("joint_pop", name, shown.time_s, size[:, j], flags, unit="cm")
        flags = (turned[:, j] > POP_DEG) & (own[:, j] < POP_CM)
        events += events_of("joint_pop", name, shown.time_s, turned[:, j], flags, unit="deg")
    hips = [event for event in events if event.joint == "hips"]
    return _without_carried(joined(events, lambda event: limb_of(event.joint)), hips)


def _cubic(step_s: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Offsets from the middle sample, and weights of the samples there for the cubic's value in the middle."""
    steps = np.arange(-round(OUTER_S / step_s), round(OUTER_S / step_s) + 1)
    inner = round(INNER_S / step_s + 1e-9)
    steps = steps[np.abs(steps) > inner] if (np.abs(steps) > inner).sum() >= 4 else steps[steps != 0]
    powers = (steps * step_s)[:, None] ** np.arange(4)
    return steps, np.linalg.pinv(powers)[0]


def off_course_cm(positions_m: NDArray[np.float64], step_s: float) -> NDArray[np.float64]:
    """Return the distance of joints from the cubic through their neighbours [cm], shape (sample_count, joint_count).

    Above `POP_CM` it is a pop. NaN near the ends.

    Args:
        positions_m: in the stage frame, shape (sample_count, joint_count, 3).
        step_s: constant time between two samples.
    """
    return np.linalg.norm(_residual_m(positions_m, *_cubic(step_s)), axis=2) * 100.0


def _residual_m(
    positions_m: NDArray[np.float64], steps: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Positions minus their local cubics, shape (sample_count, joint_count, 3); NaN near the ends and gaps."""
    out = np.full(positions_m.shape, np.nan)
    reach = int(steps.max())
    if len(positions_m) <= 2 * reach:
        return out
    middle = positions_m[reach:-reach].copy()
    for step, weight in zip(steps, weights, strict=True):
        middle -= weight * positions_m[reach + step : len(positions_m) - reach + step]
    out[reach:-reach] = middle
    return out


def _largest_near(values: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """The largest value within `reach` samples, by column."""
    return maximum_filter1d(values, 2 * reach + 1, axis=0, mode="nearest")


def _turned_deg(
    rotations: NDArray[np.float64], steps: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Angle [deg] between each rotation and the cubic through its neighbours' rotation vectors, (sample_count, 21).

    Vectors start midway between the nearest neighbours, so that an outlier affects none of them,
    and a body that spins at 1,000 deg/s keeps them under half a turn.
    If no neighbour is half of `POP_DEG` away, the angle is 0.
    """
    count, joints = rotations.shape[:2]
    out = np.zeros((count, joints))
    reach = int(steps.max())
    if count <= 2 * reach:
        return out
    flat = rotations.reshape(count, joints, 9)  # the trace of a.T @ b is their inner product
    trace_least = np.full((count - 2 * reach, joints), 3.0)
    for step in steps:
        there = flat[reach + step : count - reach + step]
        trace_least = np.minimum(trace_least, np.vecdot(flat[reach : count - reach], there))
    suspects = np.argwhere(trace_least < 1.0 + 2.0 * np.cos(np.radians(0.5 * POP_DEG)))
    if not len(suspects):
        return out
    frames, columns = suspects[:, 0] + reach, suspects[:, 1]
    before, after = (
        Rotation.from_matrix(rotations[frames + step, columns], assume_valid=True)
        for step in (steps[steps < 0].max(), steps[steps > 0].min())
    )
    between = before * Rotation.from_rotvec(0.5 * (before.inv() * after).as_rotvec())
    predicted = np.zeros((len(frames), 3))
    back = between.inv().as_quat(scalar_first=True)
    for step, weight in zip(steps, weights, strict=True):
        there = Rotation.from_matrix(rotations[frames + step, columns], assume_valid=True)
        turn = multiply(back, there.as_quat(scalar_first=True))  # several times as fast as SciPy's product
        predicted += weight * Rotation.from_quat(turn, scalar_first=True).as_rotvec()
    middle = Rotation.from_matrix(rotations[frames, columns], assume_valid=True)
    difference = (between * Rotation.from_rotvec(predicted)).inv() * middle
    out[frames, columns] = np.degrees(difference.magnitude())
    return out


def _without_carried(events: list[CleanupEvent], hips: list[CleanupEvent]) -> list[CleanupEvent]:
    """Return the events without those of limbs during pops of the hips, which carry them."""
    return [
        event
        for event in events
        if limb_of(event.joint) == "trunk" or not any(h.start_s <= event.peak_s <= h.end_s for h in hips)
    ]

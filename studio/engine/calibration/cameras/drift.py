"""Clock drift over a whole take. A walk of half a minute gives a drift only to some tens of ppm: 0.1 s in an hour.

The rest of the take is divided into windows. In each, calibrated cameras show the same motion, and the joints'
velocities give the delay between two cameras. The drift is the slope of a robust line through all windows (Theil-Sen:
Sen, "Estimates of the regression coefficient based on Kendall's tau", J. American Statistical Association 63, 1968).
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import GRID_HZ, Track, make_track, sample, velocity
from studio.engine.calibration.cameras.swaps import exchange, find_swaps
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, ClockModel

WINDOW_S, APART_S, MOST_WINDOWS = 8.0, 10.0, 120
"""Length of a window, shortest step between windows, and their largest number."""

LEAST_S = 60.0
"""Shortest rest of a take for which clocks are corrected. Each motion has its own delay of a millisecond or two; over
a shorter time, that error is larger than the walk's drift.
"""

MOST_LATE_S = 0.12
"""Largest delay of a window from the line found so far; windows beyond it are ignored."""

_LEAST_WINDOWS = 3
_STEPS, _SETTLED_S = 8, 0.002
_MOST_OFF_M = 0.3
_LEAST_MOTION_M_S, _LEAST_ROWS = 0.1, 600


def follow_clocks(
    calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]], until_s: float | None
) -> Calibration:
    """Return the calibration with clocks that hold for all frames, not only for those from which it was found.

    Args:
        calibration: of these frames.
        frames: by camera, in device time order.
        until_s: the calibration was found from frames up to this time of the stage clock; None = from all.
    """
    reference = frames[calibration.reference]
    if until_s is None or len(reference) < 2:
        return calibration
    clock = calibration.cameras[calibration.reference].clock
    first_s, last_s = (clock.stage_ns(frame.device_time_ns) * 1e-9 for frame in (reference[0], reference[-1]))
    if last_s < until_s + LEAST_S:
        return calibration
    right_s = 0.5 * (
        first_s + until_s
    )  # the clocks keep their value there: windows of other motion have their own delays
    placed = calibration.cameras[calibration.reference]
    followed = {
        name: camera
        for name, camera in calibration.cameras.items()
        if name != calibration.reference and camera.verdict != "refused"
    }
    known: dict[str, list[tuple[float, float]]] = {name: [] for name in followed}  # as `_slope` takes them
    for start_s in window_starts(first_s, last_s):
        seen = _between(reference, clock, start_s)
        for name, camera in followed.items():
            track = _between(frames[name], camera.clock, start_s)
            late_s = _late_s((seen, track), (placed, camera), start_s)
            if late_s is None:
                continue
            middle_s = start_s + 0.5 * WINDOW_S
            at_s = float(device_s(camera.clock, middle_s, camera.clock.reference_ns))
            known[name].append((at_s, middle_s + late_s - at_s))
            if len(known[name]) >= _LEAST_WINDOWS:
                clock_before = calibration.cameras[name].clock
                turned = through(clock_before, right_s, _slope(known[name]))
                followed[name] = replace(camera, clock=turned)
    return replace(calibration, cameras=calibration.cameras | followed)


def window_starts(first_s: float, last_s: float) -> NDArray[np.float64]:
    """Return the start times of the windows of a take between two times [s]."""
    return np.arange(first_s, last_s - WINDOW_S, max(APART_S, (last_s - first_s) / MOST_WINDOWS))


def device_s(clock: ClockModel, stage_s: NDArray[np.float64] | float, since_ns: int) -> NDArray[np.float64]:
    """Return device times, counted from a given one [s], of stage times [s]."""
    return np.asarray(stage_s - clock.stage_ns(since_ns) * 1e-9) / (1.0 + clock.drift_ppm * 1e-6)


def _slope(known: list[tuple[float, float]]) -> float:
    """Return the drift from pairs of device time since the clock's reference and offset [s]."""
    from scipy.stats import theilslopes  # takes most of a second to load, and few takes are long enough

    device, offset = np.array(known).T
    return float(theilslopes(offset, device)[0])


def through(clock: ClockModel, right_s: float, drift: float) -> ClockModel:
    """Return the clock with another drift, unchanged at a stage time [s]."""
    turned_s = (drift - clock.drift_ppm * 1e-6) * float(device_s(clock, right_s, clock.reference_ns))
    return ClockModel(clock.offset_ns - round(turned_s * 1e9), drift * 1e6, clock.reference_ns)


def _between(frames: Sequence[CameraFrame], clock: ClockModel, start_s: float) -> Track:
    """Return a camera's frames of the window that begins at a stage time [s], and of half a second on both sides."""
    ends = (
        bisect_left(frames, round(stage_s * 1e9), key=lambda frame: clock.stage_ns(frame.device_time_ns))
        for stage_s in (start_s - 0.5, start_s + WINDOW_S + 0.5)
    )
    return make_track(frames[slice(*ends)])


def _late_s(
    tracks: tuple[Track, Track], cameras: tuple[CameraCalibration, CameraCalibration], start_s: float
) -> float | None:
    """Return the delay of the second camera's motion relative to its clock [s]; None where unknown."""
    if min(len(track.times_s) for track in tracks) < 2:
        return None
    stage_s = np.arange(start_s, start_s + WINDOW_S, 1.0 / GRID_HZ)
    late_s = 0.0
    for _ in range(_STEPS):
        placed, moving = zip(
            *(
                _seen(track, camera, stage_s - shift_s)
                for track, camera, shift_s in zip(tracks, cameras, (0.0, late_s), strict=True)
            ),
            strict=True,
        )
        swapped = find_swaps(np.array(placed))
        off = exchange(placed[1], swapped[1]) - placed[0]
        step_s = _step_s(off, (moving[0] + exchange(moving[1], swapped[1])) / 2.0)
        if step_s is None or abs(late_s + step_s) > MOST_LATE_S:
            return None
        late_s += step_s
        if abs(step_s) < _SETTLED_S:
            return late_s
    return None


def _seen(
    track: Track, camera: CameraCalibration, stage_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return joints [m] and velocities [m/s] in the stage frame at stage times, shapes (instant_count, 21, 3)."""
    times_s = device_s(camera.clock, stage_s, track.epoch_ns)
    joints = unbiased(sample(track, times_s)[0], camera.depth_bias_m)
    T = camera.T_stage_camera
    return transform_points(T, joints), velocity(track, times_s) @ T[:3, :3].T


def _step_s(off: NDArray[np.float64], moving: NDArray[np.float64]) -> float | None:
    """Return the time by which joints are early [s], from their lead [m] and their velocity [m/s], shapes
    (instant_count, 21, 3).

    The constant part of a joint's lead is the cameras' disagreement about its place, and is removed.
    """
    good = (np.linalg.norm(off, axis=2) < _MOST_OFF_M) & (moving != 0.0).any(axis=2)
    if good.sum() < _LEAST_ROWS:
        return None
    weight = good[..., None].astype(float)
    count = np.maximum(weight.sum(axis=0), 1.0)
    off, moving = (np.where(good[..., None], x, 0.0) for x in (off, moving))
    off, moving = (weight * (x - x.sum(axis=0) / count) for x in (off, moving))
    motion = (moving**2).sum()
    if motion < good.sum() * _LEAST_MOTION_M_S**2:
        return None
    return float((off * moving).sum() / motion)

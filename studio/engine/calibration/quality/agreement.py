"""Spans of a take in which its cameras do not agree, under the calibration of the solve."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import Track, make_track, sample
from studio.engine.calibration.cameras.swaps import exchange, find_swaps
from studio.engine.calibration.quality.spans import BLOCK_S, Shifts, inside_any
from studio.engine.calibration.quality.watch import ALARM_M
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.model.spans import Span

_RATE_HZ = 15.0
_PART_S = 60 * BLOCK_S
"""Time processed at once, which bounds memory."""


def disagreements(
    calibration: Calibration,
    frames: Mapping[str, Sequence[CameraFrame]],
    *,
    from_s: float | None = None,
) -> dict[str, list[Span]]:
    """Return by camera the spans, in stage time [s], in which its joints were over 6 cm from the other cameras' in
    blocks of 5 s.

    The threshold is that of the live watch: a bending body shows its cameras different sides, which differ by up to
    5 cm. Two cameras have the same spans, because the joints do not show which one is wrong.

    Args:
        calibration: places the cameras; cameras that it lacks are left out.
        frames: by camera, in device time order, of one performer.
        from_s: earlier stage times are left out.
    """
    cameras = {name: calibration.cameras[name] for name in calibration.cameras if frames.get(name)}
    tracks = {name: make_track(frames[name]) for name in cameras}
    if len(cameras) < 2:
        return {name: [] for name in cameras}
    starts = {name: camera.clock.stage_ns(tracks[name].epoch_ns) * 1e-9 for name, camera in cameras.items()}
    begin_s = starts.get(calibration.reference, min(starts.values()))
    end_s = max(start_s + tracks[name].times_s[-1] for name, start_s in starts.items())
    shifts = Shifts(len(cameras), ALARM_M)
    first = 0.0 if from_s is None else max(0.0, from_s - begin_s)
    for part_s in np.arange(np.floor(first / BLOCK_S) * BLOCK_S, end_s - begin_s, _PART_S):
        until_s = min(part_s + _PART_S, end_s - begin_s)
        times = np.arange(part_s, until_s - 0.5 / _RATE_HZ, 1.0 / _RATE_HZ)
        times = times[times >= first]
        if len(times) == 0:
            continue
        joints = np.array(
            [
                _placed(tracks[name], camera, times + begin_s - starts[name])
                for name, camera in cameras.items()
            ]
        )
        swapped = find_swaps(joints)
        ordered = np.array([exchange(mine, swap) for mine, swap in zip(joints, swapped, strict=True)])
        shifts.add(ordered, times)
    return {
        name: [span.later(begin_s) for span in spans]
        for name, spans in zip(cameras, shifts.spans(), strict=True)
    }


def without_named(
    calibration: Calibration,
    frames: Mapping[str, Sequence[CameraFrame]],
    disagrees: Mapping[str, Sequence[Span]],
) -> dict[str, Sequence[CameraFrame]]:
    """Return each camera's frames without those in the spans in which it disagrees.

    With three cameras, one of which was moved by 5 to 10 cm, this keeps poses within 11 mm of those without the move
    instead of 36 to 39 (jumping jacks).
    """
    out = dict(frames)
    for name, spans in disagrees.items():
        named = [span for span in spans if span.named]
        if named:
            clock = calibration.cameras[name].clock
            times = np.array([clock.stage_ns(frame.device_time_ns) for frame in frames[name]]) * 1e-9
            kept = np.flatnonzero(~inside_any(named, times)).tolist()
            out[name] = [frames[name][i] for i in kept]
    return out


def agreement_figures(disagrees: Mapping[str, Sequence[Span]], begin_s: float) -> SolveMetrics:
    """Return the figures for `metrics.json`: `agreement`, in one line, and `disagrees`, the spans by camera.

    Args:
        disagrees: by camera, as `disagreements` returns them.
        begin_s: stage time of the solve's first frame, from which the line counts seconds.
    """
    told = {name: spans for name, spans in disagrees.items() if spans}
    if len(disagrees) == 2 and told:
        told = {" and ".join(told): next(iter(told.values()))}
    parts = [
        f"{name} {_when(span.later(-begin_s))} ({span.metres * 1e3:.0f} mm off)"
        for name, spans in told.items()
        for span in spans
    ]
    return {
        "agreement": "; ".join(parts) + ": doubt that part" if parts else "all cameras",
        "disagrees": {name: [span.to_json() for span in spans] for name, spans in disagrees.items() if spans},
    }


def _when(span: Span) -> str:
    if span.to_s is None:
        return f"disagreed from {span.from_s:.1f} s on"
    return f"disagreed from {span.from_s:.1f} to {span.to_s:.1f} s"


def _placed(track: Track, camera: CameraCalibration, since_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a camera's joints in the stage frame [m], shape (instant_count, 21, 3), at stage times since its first
    frame's [s]."""
    device_s = since_s / (1.0 + camera.clock.drift_ppm * 1e-6)
    return transform_points(camera.T_stage_camera, unbiased(sample(track, device_s)[0], camera.depth_bias_m))

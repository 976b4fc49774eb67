"""Quick estimate of the result of calibrating ordinary cameras by the walk so far."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from studio.engine.calibration.quality.residuals import Residuals
from studio.engine.calibration.views.calibrate import calibrate_views
from studio.engine.calibration.views.pictures import sees_no_depth, view_of
from studio.engine.model.frames import CameraFrame

LEAST_FRAMES = 200
"""Minimum number of frames of each camera for an adjustment: some seven seconds."""


def can_estimate(frames: Mapping[str, Sequence[CameraFrame]]) -> bool:
    """Whether these are two or more cameras without depth, each with enough frames."""
    return len(frames) > 1 and all(
        len(mine) >= LEAST_FRAMES and sees_no_depth(mine[-1:]) for mine in frames.values()
    )


def estimate_views(
    frames: Mapping[str, Sequence[CameraFrame]],
    starts_ns: Mapping[str, int],
    reference: str,
    height_m: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Residuals]:
    """Return the distances of each camera's landmarks from the joints that all cameras place together, across the
    line of sight and in pixels; cameras that cannot be placed yet are left out.

    Args:
        frames: see `can_estimate`; in device time order, each on its own clock.
        starts_ns: time of each camera's first frame on one common clock [ns].
        reference: the reference camera.
        height_m: the performer's, if it is known.
        progress: receives the share done.
    """
    placed = {}
    for name, mine in frames.items():
        later_ns = starts_ns[name] - mine[0].device_time_ns
        placed[name] = [replace(frame, device_time_ns=frame.device_time_ns + later_ns) for frame in mine]
    begins_ns = placed[reference][0].device_time_ns
    order = [reference, *(name for name in placed if name != reference)]
    found = calibrate_views(
        [view_of(name, placed[name], begins_ns, np.inf) for name in order],
        height_m=height_m,
        progress=progress,
    )
    rests = {name: camera.rests for name, camera in found.cameras.items() if camera.rests.count}
    return {
        name: Residuals(1e-3 * rest.median_mm, 1e-3 * rest.p95_mm, None, rest.count, rest.median_px)
        for name, rest in rests.items()
    }

"""Detects a cut at the start of a performance, after which frames from before it are left out.

Clocks are known to some milliseconds, and a recording rounds the time of its cut. Without this, a camera's first
frame could be one from before the cut, and the first pose a skeleton at the old place or between two places.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import CameraFrame

LATE_S = 0.1
"""A frame from before the cut arrives at most this long after the start [s]."""
LOOKED_S = 0.6
"""Length of the searched frames; a tracker may show nobody just after a cut [s]."""
APART_M = 0.10
"""Smallest jump of a body from its extrapolation at a cut; no body moves as a whole at ten g [m]."""
_LEAST_JOINTS = 5


def cut_between_s(frames: Sequence[CameraFrame], times_s: NDArray[np.float64]) -> tuple[float, float] | None:
    """Return the times of a camera's last frame before a cut and of its first after it [s]; None = no cut.

    Args:
        frames: of one camera in order of time, those of the first `LOOKED_S`.
        times_s: of each frame, from the start [s], shape (frame_count,).
    """
    shown = [
        (time_s, frame.positions)
        for time_s, frame in zip(times_s.tolist(), frames, strict=True)
        if np.isfinite(frame.positions[:, 0]).sum() >= _LEAST_JOINTS
    ]
    found = None
    for (a_s, before), (b_s, after), (c_s, later) in zip(shown, shown[1:], shown[2:], strict=False):
        if a_s > LATE_S or not a_s < b_s < c_s:
            break
        apart = np.linalg.norm(after - before - (later - after) * (b_s - a_s) / (c_s - b_s), axis=1)
        known = np.isfinite(apart)
        if known.sum() >= _LEAST_JOINTS and np.median(apart[known]) > APART_M:
            found = a_s, b_s
    return found

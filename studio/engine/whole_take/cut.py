"""Detects cuts: at the start of a performance, where frames from before it are left out, and within it.

Clocks are known to some milliseconds, and a recording rounds the time of its cut. Without this, a camera's first
frame could be one from before the cut, and the first pose a skeleton at the old place or between two places.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import MIRROR

LATE_S = 0.1
"""A frame from before the cut arrives at most this long after the start [s]."""
LOOKED_S = 0.6
"""Length of the searched frames; a tracker may show nobody just after a cut [s]."""
APART_M = 0.10
"""Smallest jump of a body from its extrapolation at a cut; no body moves as a whole at ten g [m]."""
_LEAST_JOINTS = 5

LEAP_M = 0.25
"""Smallest such jump at a cut within a performance [m]."""
LONGEST_GAP_S = 0.1
"""A longer gap between two frames of a camera is no cut [s]."""
STAYS_S = 0.3
"""A performer who leaps again within this time was confused with somebody else [s]."""
TOGETHER_S = 0.06
"""Largest time between the frames in which different cameras show the same cut [s]."""
_BLOCK = 1024


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


def parts_between_cuts(
    frames: Mapping[str, Sequence[CameraFrame]], times_s: Mapping[str, NDArray[np.float64]]
) -> dict[str, NDArray[np.int64]]:
    """Return by camera which part of a performance each frame belongs to, shape (frame_count,), counted from 0.

    A part ends where all cameras that show the performer show a leap of the whole body at once, as in recordings that
    were joined. A leap in one camera alone is a confusion of sides or bodies.

    Args:
        frames: by camera, in order of time, of one performer.
        times_s: of each frame on the stage clock [s], by camera, shape (frame_count,).
    """
    leaps = {name: _leaps(mine, times_s[name]) for name, mine in frames.items()}
    parts = {name: np.zeros(len(mine), dtype=np.int64) for name, mine in frames.items()}
    first = next((name for name, mine in frames.items() if len(mine) and len(leaps[name])), None)
    for at_s in times_s[first][leaps[first]] if first is not None else ():
        begins: dict[str, int] = {}
        for name, times in times_s.items():
            near = [k for k in leaps[name].tolist() if abs(times[k] - at_s) < TOGETHER_S]
            begins[name] = near[0] if near else int(np.searchsorted(times, at_s - TOGETHER_S))
            before = times[max(begins[name] - 1, 0)]
            if not near and at_s - LONGEST_GAP_S - TOGETHER_S < before < at_s - TOGETHER_S:
                break  # it shows the performer continuing
        else:
            for name, place in begins.items():
                parts[name][place:] += 1
    return parts


def _leaps(frames: Sequence[CameraFrame], times_s: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the indices of frames before which the whole body leapt away from its extrapolated path."""
    found = []
    for begin in range(0, len(frames), _BLOCK):
        first = max(begin - 2, 0)
        times = times_s[first : begin + _BLOCK]
        joints = np.array([frame.positions for frame in frames[first : begin + _BLOCK]])
        joints[~np.isfinite(joints)] = np.nan
        if len(times) < 3:
            continue
        gaps = np.maximum(np.diff(times), 1e-9)
        going_on = joints[1:-1] + (joints[1:-1] - joints[:-2]) * (gaps[1:] / gaps[:-1])[:, None, None]
        # A leap is far from the last place and from the expected one, whichever side is called left.
        apart = [
            np.linalg.norm(joints[2:] - one, axis=2)
            for place in (joints[1:-1], going_on)
            for one in (place, place[:, MIRROR])
        ]
        known = np.logical_and.reduce([np.isfinite(one).sum(axis=1) >= _LEAST_JOINTS for one in apart])
        known &= (gaps[:-1] < LONGEST_GAP_S) & (gaps[1:] < LONGEST_GAP_S)
        leapt = np.min([np.nanmedian(one[known], axis=1) for one in apart], axis=0) > LEAP_M
        found.append(first + 2 + np.flatnonzero(known)[leapt])
    leaps = np.concatenate(found) if found else np.zeros(0, dtype=np.int64)
    away_s = np.diff(times_s[leaps], prepend=-np.inf, append=np.inf)
    return leaps[(away_s[:-1] > STAYS_S) & (away_s[1:] > STAYS_S)]

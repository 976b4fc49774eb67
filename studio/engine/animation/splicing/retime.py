"""Retimed motions: parts become faster or slower, and standing feet keep their places."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.foot_lock import LEGS, feet_of
from studio.engine.animation.clip.resample import at_times
from studio.engine.animation.splicing.seam import with_feet_at
from studio.engine.edits.time_map import TimeMap
from studio.engine.model.poses import Poses

GAP_FRAMES = 1.5
"""Distance of frames [frame periods] above which there is a gap between them, which is kept."""


def retimed(poses: Poses, times: TimeMap) -> Poses:
    """Return poses at their own rate, in the time of a solve with retimed parts; without any the same object.

    Joints turn as before, only at other times, and feet pass through the same places.

    Args:
        poses: in stage time.
        times: the retimed parts.
    """
    if not times or poses.frame_count < 2:
        return poses
    first, last = times.solve_s(poses.time_s[[0, -1]])
    dt = 1.0 / poses.frames_per_second
    new_s = first + dt * np.arange(int((last - first) / dt + 1e-6) + 1)
    return at_solve_times(poses, times, new_s)


def at_solve_times(poses: Poses, times: TimeMap, new_s: NDArray[np.float64]) -> Poses:
    """Return poses at times of a retimed solve [s], shape (frame_count,), except those in a gap of the poses."""
    stage_s = np.clip(times.stage_s(new_s), poses.time_s[0], poses.time_s[-1])
    after = np.clip(np.searchsorted(poses.time_s, stage_s), 1, poses.frame_count - 1)
    kept = poses.time_s[after] - poses.time_s[after - 1] < GAP_FRAMES / poses.frames_per_second
    new_s, stage_s = new_s[kept], stage_s[kept]
    out = at_times(poses, stage_s)
    if set(LEGS) <= set(poses.joint_names):
        feet = feet_of(poses).reshape(poses.frame_count, -1)
        own = np.stack([np.interp(stage_s, poses.time_s, column) for column in feet.T], axis=1)
        out = with_feet_at(out, own.reshape(len(stage_s), 4, 3))
    return replace(out, time_s=new_s)

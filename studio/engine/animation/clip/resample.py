"""Poses on a uniform time grid."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import local_keys, world_poses
from studio.engine.animation.clip.options import MAX_FPS
from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import normalized
from studio.engine.model.poses import Poses

GRID_TOLERANCE_S = 1e-5
"""Poses whose times are this close to the uniform grid are written without resampling."""


def resampled(poses: Poses, fps: float | None = None, *, steps: int = 1) -> tuple[Poses, float]:
    """Return the poses on a uniform grid that starts at their first frame, and its rate [Hz].

    Rotations and offsets local to the parents are interpolated, so that bones keep their lengths; confidence
    and uncertainty are taken from the nearer frame.

    Args:
        poses: checked by `check_poses`.
        fps: rate of the grid [Hz]; None keeps that of the poses.
        steps: the number of the grid's steps is a multiple of this.

    Raises:
        SettingsError: fps is not in 0..1000.
    """
    rate, times = _time_grid(poses, fps, steps)
    count = len(times)
    if count <= poses.frame_count and np.abs(times - poses.time_s[:count]).max() <= GRID_TOLERANCE_S:
        return (poses if count == poses.frame_count else frames_of(poses, slice(count))), rate
    return at_times(poses, times), rate


def at_times(poses: Poses, times: NDArray[np.float64]) -> Poses:
    """Return the poses at other times, which increase, between the first and the last frame [s], shape (count,).

    Rotations and offsets local to the parents are interpolated; confidence and uncertainty are taken from the nearer
    frame.
    """
    offsets, local = local_keys(poses.parents, poses.positions_m, poses.rotations_wxyz)
    joints = len(poses.parents)
    new_offsets, new_local = np.empty((len(times), joints, 3)), np.empty((len(times), joints, 4))
    for joint in range(joints):
        new_offsets[:, joint] = _sample(poses.time_s, offsets[:, joint], times)
        new_local[:, joint] = normalized(_sample(poses.time_s, local[:, joint], times))
    del offsets, local
    positions, rotations = world_poses(poses.parents, new_offsets, new_local)
    nearest = np.searchsorted((poses.time_s[1:] + poses.time_s[:-1]) / 2, times)
    return replace(
        poses,
        time_s=times,
        positions_m=positions,
        rotations_wxyz=rotations,
        confidence=poses.confidence[nearest],
        uncertainty_mm=poses.uncertainty_mm[nearest],
    )


def frames_of(poses: Poses, frames: slice) -> Poses:
    """Return some frames of the poses."""
    keys = ("time_s", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    return replace(poses, **{key: getattr(poses, key)[frames] for key in keys})


def standard_rate(rate: float) -> float:
    """Return the whole or NTSC (n / 1.001) frame rate within 0.02 % of `rate` [Hz], or `rate` itself."""
    for factor in (1.0, 1.001):
        whole = round(rate * factor)
        if whole and abs(rate * factor - whole) <= 2e-4 * whole:
            return whole / factor
    return rate


def _time_grid(poses: Poses, fps: float | None, steps: int) -> tuple[float, NDArray[np.float64]]:
    """Return the rate [Hz] and the sampled stage times [s]."""
    if fps is not None and not 0.0 < fps <= steps * MAX_FPS:  # NaN fails too
        raise SettingsError(
            "export.fps", "fps={fps}: allowed is a number above 0 and up to {most:g}", fps=fps, most=MAX_FPS
        )
    rate = standard_rate(poses.frames_per_second if fps is None else float(fps))
    start, stop = poses.time_s[0], poses.time_s[-1]
    count = int(np.floor((stop - start) * rate + GRID_TOLERANCE_S * rate)) + 1
    count -= (count - 1) % steps
    return rate, np.minimum(start + np.arange(count) / rate, stop)


def _sample(
    time_s: NDArray[np.float64], values: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `values` at `times` by cubics with central-difference slopes, which do not ring at a spike."""
    if len(time_s) < 2:
        return np.repeat(values, len(times), axis=0)
    from scipy.interpolate import CubicHermiteSpline  # slow to load: not at the start of the server

    return CubicHermiteSpline(time_s, values, np.gradient(values, time_s, axis=0))(times)

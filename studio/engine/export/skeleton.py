"""What every animation writer needs of poses: rest offsets, local rotations and position keys, in file axes.

Poses are world positions and rotations in the stage frame. A file holds a skeleton of constant offsets, whose
zero rotations are the T-pose, and keys local to each joint's parent. `local_motion` turns one into the other,
on a uniform time grid, in the axes of the files: y up, facing +z, so (x, y, z)file = (x, z, -y)stage.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from studio.engine.errors import FormatError, SettingsError
from studio.engine.poses import Poses

OFFSET_TOLERANCE_M = 2e-5
"""A joint whose offset leaves its median by more gets position keys; a chain of 12 errs under 0.25 mm."""

GRID_TOLERANCE_S = 1e-5
"""Poses whose times are this close to the uniform grid are written as they stand, without resampling."""

MAX_FPS = 1000.0
SOLE_BELOW_JOINT_M = 0.02
"""Height of the lowest joint (the ball of the foot) over the floor in the rest pose."""


@dataclass(frozen=True)
class LocalMotion:
    """Poses as a skeleton with keys, in file axes (y up, facing +z) and metres.

    Attributes:
        joint_names: shape (joint_count,).
        parents: index of each joint's parent, -1 for the only root, which is joint 0.
        frames_per_second: of the keys [Hz]; the first key is at time 0.
        offsets_m: rest position in the parent's axes, shape (joint_count, 3); the root's is its rest
            position, over the origin with the feet on the floor.
        positions_m: joint index -> position keys in the parent's axes, shape (frame_count, 3), for the root
            and for every joint whose offset varies.
        rotations_wxyz: local rotations, shape (frame_count, joint_count, 4), signs continuous over time.
    """

    joint_names: tuple[str, ...]
    parents: NDArray[np.int64]
    frames_per_second: float
    offsets_m: NDArray[np.float64]
    positions_m: dict[int, NDArray[np.float64]]
    rotations_wxyz: NDArray[np.float64]

    @property
    def frame_count(self) -> int:
        return len(self.rotations_wxyz)

    @property
    def rest_positions_m(self) -> NDArray[np.float64]:
        """World positions of the rest pose, shape (joint_count, 3)."""
        rest = self.offsets_m.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                rest[joint] += rest[parent]
        return rest


def to_file_axes(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return stage vectors, shape (..., 3), in file axes: (x, z, -y)."""
    return np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1)


def local_motion(poses: Poses, *, fps: float | None = None) -> LocalMotion:
    """Return the poses as a rest skeleton with local keys.

    Args:
        poses: of any skeleton with one root.
        fps: rate of the keys [Hz]; None keeps that of the poses.

    Raises:
        FormatError: no frame, more than one root, a rotation of no length, or times that do not increase.
        SettingsError: fps is not in 0..1000.
    """
    _check(poses)
    rotations = poses.rotations_wxyz / np.linalg.norm(poses.rotations_wxyz, axis=-1, keepdims=True)
    local = np.empty_like(rotations)
    offsets = np.zeros((len(poses.parents), 3))
    keys: dict[int, NDArray[np.float64]] = {}
    for joint, parent in enumerate(poses.parents):
        own = Rotation.from_quat(rotations[:, joint], scalar_first=True)
        if parent < 0:
            local[:, joint] = rotations[:, joint]
            keys[joint] = poses.positions_m[:, joint]
            continue
        to_parent = Rotation.from_quat(rotations[:, parent], scalar_first=True).inv()
        local[:, joint] = (to_parent * own).as_quat(scalar_first=True)
        offset = to_parent.apply(poses.positions_m[:, joint] - poses.positions_m[:, parent])
        offsets[joint] = np.median(offset, axis=0)
        if np.linalg.norm(offset - offsets[joint], axis=1).max() > OFFSET_TOLERANCE_M:
            keys[joint] = offset
    rate, times = _time_grid(poses, fps)
    local = _continuous_signs(local)
    if times is not None:
        local = np.stack(
            [_sample(poses.time_s, local[:, joint], times) for joint in range(local.shape[1])], axis=1
        )
        local /= np.linalg.norm(local, axis=-1, keepdims=True)
        keys = {joint: _sample(poses.time_s, track, times) for joint, track in keys.items()}
    offsets = to_file_axes(offsets)
    motion = LocalMotion(
        joint_names=poses.joint_names,
        parents=poses.parents,
        frames_per_second=rate,
        offsets_m=offsets,
        positions_m={joint: to_file_axes(track) for joint, track in keys.items()},
        rotations_wxyz=np.concatenate([local[..., :1], to_file_axes(local[..., 1:])], axis=-1),
    )
    offsets[0, 1] = SOLE_BELOW_JOINT_M - motion.rest_positions_m[:, 1].min()
    return motion


def end_sites(motion: LocalMotion) -> dict[int, NDArray[np.float64]]:
    """Return where each leaf bone ends, in the leaf's axes [m]: joint index -> shape (3,), file axes.

    The head ends at its top, 11 % of the rest height above its joint; toes end forward; any other leaf (a
    finger) goes on in the direction in which it came, four fifths as long.
    """
    rest = motion.rest_positions_m
    leaves = set(range(len(motion.parents))) - set(motion.parents.tolist())
    ends = {}
    for joint in sorted(leaves):
        offset = motion.offsets_m[joint] if motion.parents[joint] >= 0 else np.zeros(3)
        length = float(np.linalg.norm(offset))
        if motion.joint_names[joint] == "Head":
            ends[joint] = np.array([0.0, 0.11 * rest[joint, 1], 0.0])
        elif motion.joint_names[joint].endswith("ToeBase"):
            ends[joint] = np.array([0.0, 0.0, max(0.45 * length, 0.01)])
        else:
            ends[joint] = 0.8 * offset if length > 0.005 else np.array([0.0, 0.03, 0.0])
    return ends


def _check(poses: Poses) -> None:
    if poses.frame_count == 0:
        raise FormatError("poses: no frame to export; solve a take that has frames")
    if (poses.parents < 0).sum() != 1 or poses.parents[0] >= 0:
        raise FormatError(f"poses: {(poses.parents < 0).sum()} joints have no parent; export needs one root")
    if np.linalg.norm(poses.rotations_wxyz, axis=-1).min() < 1e-6:
        raise FormatError("poses: a rotation is a quaternion of no length; solve the take again")
    if poses.frame_count > 1 and np.diff(poses.time_s).min() <= 0:
        raise FormatError("poses: the times of the frames do not increase; solve the take again")


def _time_grid(poses: Poses, fps: float | None) -> tuple[float, NDArray[np.float64] | None]:
    """Return the rate [Hz] and the stage times to sample at [s], None where the frames already are there."""
    if fps is not None and not 0.0 < fps <= MAX_FPS:  # NaN fails too
        raise SettingsError(f"fps={fps}: allowed is a number above 0 and up to {MAX_FPS:g}")
    rate = standard_rate(poses.frames_per_second if fps is None else float(fps))
    start, stop = poses.time_s[0], poses.time_s[-1]
    count = int(np.floor((stop - start) * rate + GRID_TOLERANCE_S * rate)) + 1
    grid = start + np.arange(count) / rate
    if count == poses.frame_count and np.abs(grid - poses.time_s).max() <= GRID_TOLERANCE_S:
        return rate, None
    return rate, np.minimum(grid, stop)


def standard_rate(rate: float) -> float:
    """Return the whole or NTSC (n / 1.001) frame rate within 0.02 % of `rate` [Hz], or `rate` itself."""
    for factor in (1.0, 1.001):
        whole = round(rate * factor)
        if whole and abs(rate * factor - whole) <= 2e-4 * whole:
            return whole / factor
    return rate


def _continuous_signs(quaternions_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions, shape (frame_count, joint_count, 4), each on the half-sphere of the one before."""
    dots = (quaternions_wxyz[1:] * quaternions_wxyz[:-1]).sum(axis=-1)
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    quaternions_wxyz[1:] *= signs[..., None]
    return quaternions_wxyz


def _sample(
    time_s: NDArray[np.float64], values: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `values` at `times` by cubics with central-difference slopes, so a spike does not ring."""
    if len(time_s) < 2:
        return np.repeat(values, len(times), axis=0)
    return CubicHermiteSpline(time_s, values, np.gradient(values, time_s, axis=0))(times)

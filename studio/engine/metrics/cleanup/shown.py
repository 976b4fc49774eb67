"""The animation as played from its exported keys, at every key and in the middle between two.

Keys are those of the exports (`animation.clip.skeleton.local_motion`): local rotations and the root's position, on a
uniform grid. Between keys a player follows the cubic curves of an FBX (`animation.curves.keys.curve_keys`) through
the Euler angles of each joint.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.skeleton import LocalMotion, local_motion
from studio.engine.animation.curves.euler import best_order, euler_deg
from studio.engine.animation.curves.keys import curve_keys
from studio.engine.model.joints import CANONICAL, JOINT_COUNT, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses

SAMPLES_PER_KEY = 2


@dataclass(frozen=True)
class ShownMotion:
    """An animation on a uniform time grid, in the stage frame (metres, z up, the floor of the file at z = 0).

    Attributes:
        time_s: stage time of each sample [s], shape (sample_count,).
        positions_m: canonical joints, shape (sample_count, 21, 3); NaN = the skeleton lacks the joint.
        rotations: world rotations of the canonical joints, shape (sample_count, 21, 3, 3); the identity in the T-pose
            and for missing joints.
        rest_m: canonical joints in the T-pose, soles on the floor, shape (21, 3); NaN = missing.
    """

    time_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    rotations: NDArray[np.float64]
    rest_m: NDArray[np.float64]

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    def frames(self, seconds: float) -> int:
        """Return the number of steps in a duration, at least one."""
        return max(1, round(seconds / self.step_s))


def shown_animation(poses: Poses) -> ShownMotion:
    """Return the poses as played from their export.

    Raises:
        FormatError: poses that cannot be exported.
    """
    motion = local_motion(poses)
    index = {name: i for i, name in enumerate(motion.joint_names)}
    columns = np.array([index.get(OUTPUT_OF_CANONICAL[name], index.get(name, -1)) for name in CANONICAL])
    keys = np.arange(motion.frame_count) / motion.frames_per_second
    count = SAMPLES_PER_KEY * (motion.frame_count - 1) + 1
    times = np.arange(count) / (SAMPLES_PER_KEY * motion.frames_per_second)
    positions, rotations = _world(motion, keys, times, columns[columns >= 0])
    out_positions = np.full((count, JOINT_COUNT, 3), np.nan)
    out_rotations = np.tile(np.eye(3), (count, JOINT_COUNT, 1, 1))
    rest = np.full((JOINT_COUNT, 3), np.nan)
    known = np.flatnonzero(columns >= 0)
    out_positions[:, known] = np.stack([_to_stage(positions[j]) for j in columns[known]], axis=1)
    for place in known:
        out_rotations[:, place] = _STAGE_FILE @ rotations[columns[place]] @ _STAGE_FILE.T
    rest[known] = _to_stage(motion.rest_positions_m[columns[known]])
    return ShownMotion(poses.time_s[0] + times, out_positions, out_rotations, rest)


_STAGE_FILE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def _to_stage(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """File vectors, shape (..., 3), in stage axes: the inverse of `clip.skeleton.to_file_axes`."""
    return np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)


def _world(
    motion: LocalMotion, keys: NDArray[np.float64], times: NDArray[np.float64], wanted: NDArray[np.int64]
) -> tuple[dict[int, NDArray[np.float64]], dict[int, NDArray[np.float64]]]:
    """World positions and rotations in file axes of the wanted joints and their ancestors, by joint."""
    needed: set[int] = set()
    for joint in wanted.tolist():
        while joint >= 0 and joint not in needed:
            needed.add(joint)
            joint = int(motion.parents[joint])
    positions: dict[int, NDArray[np.float64]] = {}
    rotations: dict[int, NDArray[np.float64]] = {}
    for joint in sorted(needed):  # parents come before children
        local = _played_rotation(motion.rotations_wxyz[:, joint], keys, times)
        track = motion.positions_m.get(joint)
        offset = motion.offsets_m[joint] if track is None else _played(keys, track * 100.0, times) / 100.0
        parent = int(motion.parents[joint])
        if parent < 0:
            positions[joint] = np.broadcast_to(offset, (len(times), 3))
            rotations[joint] = local
        else:
            carried = rotations[parent] @ np.broadcast_to(offset, (len(times), 3))[..., None]
            positions[joint] = positions[parent] + carried[..., 0]
            rotations[joint] = rotations[parent] @ local
    return positions, rotations


def _played_rotation(
    rotations_wxyz: NDArray[np.float64], keys: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    order = best_order(rotations_wxyz)
    angles = _played(keys, euler_deg(rotations_wxyz, order), times)
    columns = ["XYZ".index(axis) for axis in order]
    return Rotation.from_euler(order, angles[:, columns], degrees=True).as_matrix()


def _played(
    keys: NDArray[np.float64], values: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return values [deg or cm], shape (key_count, 3), at times, along the curves of an export."""
    if len(keys) < 3:
        return np.stack([np.interp(times, keys, values[:, k]) for k in range(values.shape[1])], axis=1)
    rate = 1.0 / (keys[1] - keys[0])
    automatic = np.gradient(values, keys, axis=0)
    own = np.stack([curve_keys(track, rate, "cubic").slopes for track in values.T], axis=1)
    return CubicHermiteSpline(keys, values, np.where(np.isnan(own), automatic, own))(times)

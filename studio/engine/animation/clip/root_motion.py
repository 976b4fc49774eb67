"""Carrier of the performer's path: the hips, a bone on the floor, or none."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.base.quaternions import IDENTITY, continuous_signs, inverse, multiply

_OFF_AXIS_M = 0.001
"""Rest position of the hips before a root bone. Blender locks the position of a joint on its parent's y axis."""

_UPSIDE_DOWN = 0.05
"""Hips are upside down if their turn about the vertical is less than this share of their rotation."""


def with_root_motion(motion: LocalMotion, root_motion: str, root_name: str | None) -> LocalMotion:
    """Return the motion with its path on the chosen carrier.

    `in-place` keeps the hips over the origin, with their height and rotation. A `root` bone lies on the
    floor under the hips and turns with them about the vertical; the hips keep the rest.

    Args:
        motion: with identity axes in the rest pose, hips first.
        root_motion: one of `ROOT_MOTIONS`.
        root_name: of the added bone; None adds one only where the root bone carries the path.
    """
    path = motion.positions_m[0] * [1.0, 0.0, 1.0]
    if root_motion == "in-place":
        motion = replace(motion, positions_m={**motion.positions_m, 0: motion.positions_m[0] - path})
    if root_motion != "root":
        return motion if root_name is None else _added(motion, root_name, None, None)
    heading = heading_of(motion.rotations_wxyz[:, 0])
    rotations = motion.rotations_wxyz.copy()
    rotations[:, 0] = continuous_signs(multiply(inverse(heading), rotations[:, 0]))
    positions = {**motion.positions_m, 0: motion.positions_m[0] - path}
    motion = replace(motion, rotations_wxyz=rotations, positions_m=positions)
    return _added(motion, root_name or "Root", path, heading)


def heading_of(hips_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the turn about the vertical (y) of the hips, shape (frame_count, 4).

    It is interpolated across frames upside down, where it is undefined.
    """
    w, y = hips_wxyz[:, 0], hips_wxyz[:, 2]
    sure = np.flatnonzero(np.hypot(w, y) > _UPSIDE_DOWN)
    out = np.tile(IDENTITY, (len(w), 1))
    if sure.size:
        half = np.unwrap(2.0 * np.arctan2(y[sure], w[sure])) / 2
        half = np.interp(np.arange(len(w)), sure, half)
        out[:, 0], out[:, 2] = np.cos(half), np.sin(half)
    return out


def _added(
    motion: LocalMotion, name: str, path: NDArray[np.float64] | None, heading: NDArray[np.float64] | None
) -> LocalMotion:
    """Return the motion under a root bone at the origin, which follows `path` and `heading` if given."""
    turns = np.tile(IDENTITY, (motion.frame_count, 1))
    if heading is not None:
        turns = heading
    positions = {joint + 1: keys for joint, keys in motion.positions_m.items()}
    if path is not None:
        positions[0] = path
    offsets = motion.offsets_m.copy()
    offsets[0, 2] += _OFF_AXIS_M
    return replace(
        motion,
        joint_names=(name, *motion.joint_names),
        roles=("", *motion.roles),
        parents=np.concatenate([[-1], motion.parents + 1]),
        offsets_m=np.concatenate([np.zeros((1, 3)), offsets]),
        rest_rotations_wxyz=np.concatenate([[IDENTITY], motion.rest_rotations_wxyz]),
        positions_m=positions,
        rotations_wxyz=np.concatenate([turns[:, None], motion.rotations_wxyz], axis=1),
    )

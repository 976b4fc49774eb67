"""The exports on which every reader is checked: all targets and root motions, over the options."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.options import ROOT_MOTIONS, TARGETS
from studio.engine.animation.clip.skeleton import LocalMotion, rotations_to_file_axes, to_file_axes
from studio.engine.animation.export import ExportOptions, clip
from studio.engine.model.poses import Poses
from tests.poses_factory import random_poses

SECONDS = 0.5

_VARIANTS: dict[str, ExportOptions] = {
    "60 Hz": ExportOptions(fps=60.0),
    "linear 30 Hz, mesh": ExportOptions(fps=30.0, interpolation="linear", mesh=True),
    "constant 24 Hz": ExportOptions(fps=24.0, interpolation="constant", take_name="Läufer 7"),
    "fewer keys at 60 Hz": ExportOptions(fps=60.0, key_error_cm=0.04),
    "fewer straight keys at 60 Hz": ExportOptions(fps=60.0, key_error_cm=0.04, interpolation="linear"),
    "120 Hz at a time of day": ExportOptions(fps=120.0, timecode="01:02:03:04"),
}

FBX_MATRIX: dict[str, ExportOptions] = {
    f"{target}, {root_motion}, {name}": replace(options, target=target, root_motion=root_motion)
    for target in TARGETS
    for root_motion in ROOT_MOTIONS
    for name, options in _VARIANTS.items()
}
"""Name -> options of 72 FBX files."""

PAIRS = frozenset(
    f"{target}, {ROOT_MOTIONS[(t + v) % len(ROOT_MOTIONS)]}, {name}"
    for t, target in enumerate(TARGETS)
    for v, name in enumerate(_VARIANTS)
)
"""24 of these files; every pair of target, root motion and variant occurs in one of them."""

BVH_MATRIX: dict[str, ExportOptions] = {
    f"{target}, {root_motion}, {order} {unit}": ExportOptions(
        target=target, root_motion=root_motion, rotation_order=order, unit=unit, fps=30.0
    )
    for target in TARGETS
    for root_motion, order, unit in (("hips", "ZXY", "cm"), ("root", "XYZ", "m"), ("in-place", "YXZ", "in"))
}
"""Name -> options of 12 BVH files."""


@cache
def source() -> Poses:
    """Return the 120 Hz clip that is exported."""
    return random_poses(np.random.default_rng(2), seconds=SECONDS, hz=120, angle_sd_rad=0.3)


@dataclass(frozen=True)
class Truth:
    """Places of joints, from the poses alone: names, their columns in the file's skeleton, world positions [cm] and
    rotations per sample, and the expected skeleton of the file."""

    names: tuple[str, ...]
    positions_cm: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]
    motion: LocalMotion


@cache
def truth(options: ExportOptions, hz: float) -> Truth:
    """Return the truth of an export sampled at `hz`, for the joints that correspond to one of the performer's."""
    poses = random_poses(np.random.default_rng(2), seconds=SECONDS, hz=hz, angle_sd_rad=0.3)
    motion = clip(source(), options)
    columns = [poses.joint_names.index(role) for role in motion.roles if role]
    positions = to_file_axes(poses.positions_m)
    if options.root_motion == "in-place":
        positions = positions - positions[:, :1] * [1.0, 0.0, 1.0]
    standing = np.array([bool(role) for role in motion.roles])
    world = rotations_to_file_axes(poses.rotations_wxyz[:, columns])
    axes = Rotation.from_quat(
        np.tile(motion.rest_rotations_wxyz[standing], (len(world), 1)), scalar_first=True
    )
    turned = Rotation.from_quat(world.reshape(-1, 4), scalar_first=True) * axes
    return Truth(
        names=tuple(name for name, role in zip(motion.joint_names, motion.roles, strict=True) if role),
        positions_cm=positions[:, columns] * 100.0,
        rotations_wxyz=turned.as_quat(scalar_first=True).reshape(world.shape),
        motion=motion,
    )

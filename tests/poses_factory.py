"""Synthetic poses of the output skeleton: smooth random joint rotations, forward kinematics, known truth."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.model.joints import FINGERS, OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.poses import Poses

_BODY = {
    "Hips": (0, 0, 0.94), "Spine": (0, 0.01, 0.10), "Spine1": (0, 0.01, 0.13), "Spine2": (0, 0, 0.13),
    "Neck": (0, -0.01, 0.20), "Head": (0, -0.02, 0.10),
    "LeftShoulder": (0.03, 0, 0.14), "LeftArm": (0.15, 0.01, 0), "LeftForeArm": (0.28, 0, 0),
    "LeftHand": (0.25, 0, 0),
    "LeftUpLeg": (0.09, 0, -0.05), "LeftLeg": (0, 0, -0.42), "LeftFoot": (0, 0.01, -0.40),
    "LeftToeBase": (0, -0.14, -0.05),
}  # fmt: skip
_KNUCKLES = {"Thumb": (0.03, -0.03, -0.01), "Index": (0.09, -0.03, 0), "Middle": (0.095, -0.005, 0),
             "Ring": (0.09, 0.015, 0), "Pinky": (0.08, 0.035, 0)}  # fmt: skip


def rest_offsets_m() -> NDArray[np.float64]:
    """Offset of each output joint from its parent in the T-pose, stage axes [m], shape (52, 3)."""
    left = dict(_BODY)
    for finger in FINGERS:
        left[f"LeftHand{finger}1"] = _KNUCKLES[finger]
        for k in (2, 3):
            left[f"LeftHand{finger}{k}"] = (0.025, -0.01, 0) if finger == "Thumb" else (0.03, 0, 0)
    offsets = np.zeros((len(OUTPUT_JOINTS), 3))
    for name, offset in left.items():
        offsets[OUTPUT_INDEX[name]] = offset
        if name.startswith("Left"):
            offsets[OUTPUT_INDEX["Right" + name[4:]]] = np.array(offset) * [-1, 1, 1]
    return offsets


def make_poses(
    local: NDArray[np.float64],
    *,
    hz: float = 60.0,
    root_m: NDArray[np.float64] | None = None,
    offsets_m: NDArray[np.float64] | None = None,
) -> Poses:
    """Return poses of the output skeleton from local rotations, by forward kinematics.

    Args:
        local: local wxyz quaternions, shape (frame_count, 52, 4); the identity everywhere is the T-pose.
        hz: frame rate.
        root_m: hips in the stage frame [m], shape (frame_count, 3); None stands at the origin.
        offsets_m: offsets from the parents [m], shape (52, 3) or (frame_count, 52, 3).
    """
    frames, joints = local.shape[:2]
    offsets = np.broadcast_to(
        rest_offsets_m() if offsets_m is None else offsets_m, (frames, joints, 3)
    ).copy()
    positions, rotations = np.empty((frames, joints, 3)), np.empty((frames, joints, 4))
    world: list[Rotation] = []
    for joint, parent in enumerate(OUTPUT_PARENTS):
        own = Rotation.from_quat(local[:, joint], scalar_first=True)
        if parent < 0:
            positions[:, joint] = offsets[:, joint] if root_m is None else root_m
            world.append(own)
        else:
            positions[:, joint] = positions[:, parent] + world[parent].apply(offsets[:, joint])
            world.append(world[parent] * own)
        rotations[:, joint] = world[joint].as_quat(scalar_first=True)
    return Poses(
        time_s=np.arange(frames) / hz,
        joint_names=OUTPUT_JOINTS,
        parents=OUTPUT_PARENTS,
        positions_m=positions,
        rotations_wxyz=rotations,
        confidence=np.ones((frames, joints)),
        uncertainty_mm=np.full((frames, joints), np.nan),
    )


def t_pose(frames: int = 1, *, hz: float = 60.0) -> Poses:
    """Return poses that stand in the T-pose at the origin, facing -y."""
    local = np.zeros((frames, len(OUTPUT_JOINTS), 4))
    local[..., 0] = 1.0
    return make_poses(local, hz=hz)


def smooth_noise(
    rng: np.random.Generator, time_s: NDArray[np.float64], channels: int, *, cutoff_hz: float = 2.0
) -> NDArray[np.float64]:
    """Return smooth random signals of unit variance, shape (frame_count, channels): sums of eight sines.

    The signals depend on `rng` and time alone, so another frame rate samples the same motion.
    """
    frequency = rng.uniform(0.05, cutoff_hz, (8, channels))
    phase = rng.uniform(0.0, 2 * np.pi, (8, channels))
    return np.sin(2 * np.pi * frequency * time_s[:, None, None] + phase).sum(axis=1) / 2.0


def random_poses(
    rng: np.random.Generator,
    *,
    seconds: float = 4.0,
    hz: float = 60.0,
    angle_sd_rad: float = 0.4,
    cutoff_hz: float = 2.0,
    turns_per_s: float = 0.0,
    offset_sd_m: float = 0.0,
    shape_local: Callable[[NDArray[np.float64], NDArray[np.float64]], None] | None = None,
) -> Poses:
    """Return smooth random poses: the whole body moves, the hips wander.

    Args:
        rng: decides the motion, whatever `hz` is.
        seconds: from the first frame to the last.
        hz: frame rate.
        angle_sd_rad: SD of each component of the joints' rotation vectors [rad].
        cutoff_hz: highest frequency of the motion.
        turns_per_s: steady turning of the hips about the vertical [rev/s].
        offset_sd_m: SD of each bone's offset over time [m], as of a solve without a model.
        shape_local: called with (time_s, rotation vectors, shape (frame_count, 52, 3)) to edit them in place.
    """
    time_s = np.arange(round(seconds * hz) + 1) / hz
    joints = len(OUTPUT_JOINTS)
    vectors = smooth_noise(rng, time_s, joints * 3, cutoff_hz=cutoff_hz).reshape(-1, joints, 3) * angle_sd_rad
    root = rest_offsets_m()[0] + smooth_noise(rng, time_s, 3, cutoff_hz=1.0) * [0.4, 0.4, 0.05]
    wobble = smooth_noise(rng, time_s, joints * 3, cutoff_hz=cutoff_hz).reshape(-1, joints, 3) * offset_sd_m
    if shape_local is not None:
        shape_local(time_s, vectors)
    local = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True).reshape(-1, joints, 4)
    turn = Rotation.from_rotvec(np.outer(2 * np.pi * turns_per_s * time_s, [0.0, 0.0, 1.0]))
    hips = turn * Rotation.from_quat(local[:, 0], scalar_first=True)
    local[:, 0] = hips.as_quat(scalar_first=True)
    return make_poses(local, hz=hz, root_m=root, offsets_m=rest_offsets_m() + wobble)

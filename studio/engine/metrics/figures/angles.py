"""Joint angles from joint centres, after the recommendations of the International Society of Biomechanics.

Segments have axes x forward, y up, z to the right. The nearest joint centres replace landmarks on the skin:
the thorax from spine to neck and from shoulder to shoulder, the pelvis from hips to spine and from hip to hip.
The left side is mirrored. Angles that joint centres do not show (forearm and shank rotation, knee abduction, wrist,
inversion of the foot) are left out. Rotations of an arm or leg about its own axis are known while its elbow or knee
is bent by over 20 degrees, planes while the arm is at least 20 degrees off the thorax's axis.
Source: Wu et al., "ISB recommendation on definitions of joint coordinate systems of various joints for the reporting
of human joint motion", part I (ankle, hip, spine), J. Biomech. 2002, and part II (shoulder, elbow), 2005: hip and
trunk by Grood and Suntay's order z, x, y; shoulder by y, x, y, the humerus by its second option.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.results import AngleError
from studio.engine.model.joints import INDEX

Array = NDArray[np.float64]

LEAST_BEND_DEG = 20.0
_SIDES = ("left", "right")

ANGLES: tuple[str, ...] = (
    "trunk_flexion", "trunk_side", "trunk_rotation", "neck_flexion", "neck_side",
    *(f"{side}_{name}" for side in _SIDES for name in (
        "shoulder_plane", "shoulder_elevation", "shoulder_rotation", "elbow_flexion",
        "hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_dorsiflexion")),
)  # fmt: skip
"""Names of the angles, in the order of the last axis of `joint_angles_deg`."""


def joint_angles_deg(positions_m: Array) -> Array:
    """Return the joint angles [deg], shape (frame_count, len(ANGLES)); NaN = unknown.

    Args:
        positions_m: canonical joints in any right-handed frame [m], shape (frame_count, 21, 3).
    """
    joint = {name: positions_m[:, k] for name, k in INDEX.items()}
    thorax = _axes(joint["neck"] - joint["spine"], joint["right_shoulder"] - joint["left_shoulder"])
    pelvis = _axes(joint["spine"] - joint["hips"], joint["right_hip"] - joint["left_hip"])
    head = _in(thorax, joint["head"] - joint["neck"])
    columns = [
        *_z_x_y(np.einsum("nij,nkj->nik", pelvis, thorax)),
        np.arctan2(head[:, 0], head[:, 1]),
        np.arctan2(head[:, 2], np.hypot(head[:, 0], head[:, 1])),
    ]
    for side in _SIDES:
        columns += _arm(joint, thorax, side) + _leg(joint, pelvis, side)
    return np.degrees(np.stack(columns, axis=1))


def joint_angle_errors_deg(solve_m: Array, reference_m: Array) -> dict[str, AngleError]:
    """Return the error of each angle that both have."""
    difference = joint_angles_deg(solve_m) - joint_angles_deg(reference_m)
    difference = (difference + 180.0) % 360.0 - 180.0
    out: dict[str, AngleError] = {}
    for k, name in enumerate(ANGLES):
        known = difference[np.isfinite(difference[:, k]), k]
        if len(known):
            out[name] = {"error_deg": float(np.abs(known).mean()), "offset_deg": float(known.mean())}
    return out


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0.0, lengths, np.nan)


def _axes(up: Array, right: Array) -> Array:
    """Rows: x forward, y exactly along `up`, z nearest to `right`, shape (frame_count, 3, 3)."""
    y = _unit(up)
    x = _unit(np.cross(y, right))
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _in(axes: Array, vectors: Array) -> Array:
    """Vectors in a segment's axes, shape (frame_count, 3)."""
    return (axes @ vectors[..., None])[..., 0]


def _angle(a: Array, b: Array) -> Array:
    """Angle between vectors [rad], accurate near 0 and 180 degrees."""
    a, b = _unit(a), _unit(b)
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))


def _z_x_y(rotation: Array) -> list[Array]:
    """Flexion (forward positive), side bend (to the right) and rotation (to the left) of R = Rz Rx Ry [rad]."""
    side = np.arcsin(np.clip(rotation[:, 2, 1], -1.0, 1.0))
    flexion = -np.arctan2(-rotation[:, 0, 1], rotation[:, 1, 1])
    turn = np.arctan2(-rotation[:, 2, 0], rotation[:, 2, 2])
    return [flexion, side, turn]


def _limb(
    joint: dict[str, Array], axes: Array, side: str, names: tuple[str, str, str]
) -> tuple[Array, Array]:
    """Both bones of a limb relative to the trunk, in its axes, the left mirrored."""
    mirror = np.array([1.0, 1.0, -1.0 if side == "left" else 1.0])
    root, middle, end = (joint[f"{side}_{name}"] for name in names)
    return _unit(_in(axes, root - middle)) * mirror, _unit(_in(axes, middle - end)) * mirror


def _arm(joint: dict[str, Array], thorax: Array, side: str) -> list[Array]:
    """Plane of elevation (0 = to the side, 90 = forward), elevation, rotation (inward), elbow flexion [rad]."""
    y, forearm = _limb(joint, thorax, side, ("shoulder", "elbow", "wrist"))
    bend = _angle(y, forearm)
    elevation = _angle(y, np.broadcast_to([0.0, 1.0, 0.0], y.shape))
    least = np.radians(LEAST_BEND_DEG)
    off_axis = (elevation > least) & (elevation < np.pi - least)
    plane = np.where(off_axis, np.arctan2(-y[:, 0], -y[:, 2]), np.nan)
    z = _unit(np.cross(y, forearm))
    x = np.cross(y, z)
    turn = np.where(off_axis & (bend > least), np.arctan2(-x[:, 1], z[:, 1]), np.nan)
    return [plane, elevation, turn, bend]


def _leg(joint: dict[str, Array], pelvis: Array, side: str) -> list[Array]:
    """Hip flexion, abduction, rotation (inward), knee flexion, ankle dorsiflexion [rad]."""
    y, shank = _limb(joint, pelvis, side, ("hip", "knee", "ankle"))
    flexion = np.arctan2(-y[:, 0], y[:, 1])
    abduction = -np.arcsin(np.clip(y[:, 2], -1.0, 1.0))
    bend = _angle(y, shank)
    z = _unit(np.cross(shank, y))
    floating = _unit(np.cross(y, np.broadcast_to([0.0, 0.0, 1.0], y.shape)))
    x = np.cross(y, z)
    turn = np.arctan2((np.cross(floating, x) * y).sum(axis=1), (floating * x).sum(axis=1))
    turn = np.where(bend > np.radians(LEAST_BEND_DEG), turn, np.nan)
    ankle, knee, toe = (joint[f"{side}_{name}"] for name in ("ankle", "knee", "toe"))
    return [flexion, abduction, turn, bend, np.pi / 2 - _angle(knee - ankle, toe - ankle)]

"""Occlusion: joints that another part of the body hides from a camera.

The body is a set of capsules between joints. Only the simulator knows their radii; no solver may.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import CANONICAL, INDEX

_SKIN_M = 0.09
"""Minimum distance of a part in front of a joint that it hides."""

_TRUNK = ("hips", "spine", "chest", "neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
_PARTS: tuple[tuple[str, str, float, tuple[str, ...]], ...] = (
    ("hips", "chest", 0.11, (*_TRUNK,)),
    ("left_hip", "left_shoulder", 0.075, (*_TRUNK,)),
    ("right_hip", "right_shoulder", 0.075, (*_TRUNK,)),
    ("neck", "head", 0.08, ("neck", "head", "chest")),
    *(
        (f"{side}_{a}", f"{side}_{b}", radius, tuple(f"{side}_{joint}" for joint in spared))
        for side in ("left", "right")
        for a, b, radius, spared in (
            ("shoulder", "elbow", 0.05, ("shoulder", "elbow")),
            ("elbow", "wrist", 0.04, ("elbow", "wrist", "hand")),
            ("wrist", "hand", 0.04, ("wrist", "hand")),
            ("hip", "knee", 0.075, ("hip", "knee")),
            ("knee", "ankle", 0.055, ("knee", "ankle", "toe")),
            ("ankle", "toe", 0.04, ("ankle", "toe")),
        )
    ),
)  # part: from joint, to joint, radius [m], its own joints, which it never hides
_FROM = np.array([INDEX[a] for a, _, _, _ in _PARTS])
_TO = np.array([INDEX[b] for _, b, _, _ in _PARTS])
_RADIUS = np.array([radius for _, _, radius, _ in _PARTS])
_SPARED = np.array([[joint in spared for *_, spared in _PARTS] for joint in CANONICAL])


def hidden_joints(joints: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which joints another body part hides from a camera, shape (F, 21).

    Args:
        joints: joint centres [m], shape (F, 21, 3).
        eye: optical centre in the same frame, shape (3,).
    """
    return np.logical_or.reduce(_behind_parts(joints, joints, eye) & ~_SPARED, axis=-1)


def hidden_by(
    joints: NDArray[np.float64], other: NDArray[np.float64], eye: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which joints another performer hides from a camera, shape (F, 21).

    Args:
        joints, other: joint centres of both [m], shape (F, 21, 3).
        eye: optical centre in the same frame, shape (3,).
    """
    return np.logical_or.reduce(_behind_parts(joints, other, eye), axis=-1)


def _behind_parts(
    joints: NDArray[np.float64], body: NDArray[np.float64], eye: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which parts of a body each joint is behind, shape (F, 21, part_count)."""
    way = joints - eye
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    sight = way * np.maximum(1 - _SKIN_M / length, 0.0)  # from the eye to just before the joint
    start, part = body[:, _FROM], body[:, _TO] - body[:, _FROM]
    distance = segment_distance(eye, sight[:, :, None, :], start[:, None], part[:, None])
    return distance < _RADIUS


def segment_distance(
    eye: NDArray[np.float64], d1: NDArray[np.float64], p2: NDArray[np.float64], d2: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance between segments eye..eye+d1 and p2..p2+d2, broadcast.

    Source: Ericson, "Real-Time Collision Detection", section 5.1.9.
    """
    r = eye - p2
    a, e = np.vecdot(d1, d1), np.maximum(np.vecdot(d2, d2), 1e-12)
    b, c, f = np.vecdot(d1, d2), np.vecdot(d1, r), np.vecdot(d2, r)
    denominator = a * e - b * b
    s = np.clip((b * f - c * e) / np.maximum(denominator, 1e-12), 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / np.maximum(a, 1e-12), 0.0, 1.0)
    gap = r + s[..., None] * d1 - t[..., None] * d2
    return np.sqrt(np.vecdot(gap, gap))

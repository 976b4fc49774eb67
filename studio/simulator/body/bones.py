"""The bones of the skin: names, centres of rotation, and skinning weights."""

import numpy as np
from numpy.typing import NDArray

from studio.simulator.body.frame import SIDES, Frame
from studio.simulator.body.hand import BONES_PER_HAND

Array = NDArray[np.float64]

_LIMB = ("clavicle", "upper_arm", "upper_arm_end", "forearm", "forearm_end", "hand", "thigh", "thigh_end", "shin",
         "foot")  # fmt: skip
BONES: tuple[str, ...] = (
    "pelvis", "spine", "chest", "neck", "head", *(f"{side}_{name}" for side, _ in SIDES for name in _LIMB)
)  # fmt: skip
"""Bones of the body; the `_end` of a long bone carries its twist. The fingers' bones follow, left then right."""

BONE: dict[str, int] = {name: i for i, name in enumerate(BONES)}
BONE_COUNT = len(BONES) + 2 * BONES_PER_HAND

_ANCHOR = {"clavicle": "shoulder", "upper_arm": "shoulder", "upper_arm_end": "shoulder", "forearm": "elbow",
           "forearm_end": "elbow", "hand": "wrist", "thigh": "hip", "thigh_end": "hip", "shin": "knee",
           "foot": "ankle"}  # fmt: skip
ANCHORS: tuple[str, ...] = (
    "hips", "spine", "chest", "neck", "head", *(f"{side}_{_ANCHOR[name]}" for side, _ in SIDES for name in _LIMB)
)  # fmt: skip
"""Canonical joint at the start of each bone of the body."""

_KEPT = 4
"""Maximum number of bones per point."""


def _rise(value: Array, low: float, high: float) -> Array:
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def body_weights(frame: Frame, points: Array) -> Array:
    """Return the bones' weights at points of the T-pose [m], shape (n, 3) -> (n, BONE_COUNT); rows sum to 1."""
    weight = np.zeros((len(points), BONE_COUNT))
    rest = np.ones(len(points))
    for side, sign in SIDES:
        arm = _arm_share(frame, points, side, sign)
        leg = _leg_share(frame, points, side, sign)
        _arm(weight, frame, points, side, sign, arm)
        _leg(weight, frame, points, side, leg)
        rest = rest - arm - leg
    rest = np.maximum(rest, 0.0)
    trunk = _trunk(frame, points)
    for side, sign in SIDES:
        clavicle = _clavicle_share(frame, points, side, sign) * trunk[:, BONE["chest"]]
        trunk[:, BONE[f"{side}_clavicle"]] = clavicle
        trunk[:, BONE["chest"]] -= clavicle
    weight += rest[:, None] * trunk
    return weight / weight.sum(axis=1, keepdims=True)


def strongest(weight: Array) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return each point's four bones of largest weight, and the weights, both shape (n, 4)."""
    order = np.argsort(-weight, axis=1, kind="stable")[:, :_KEPT]
    kept = np.take_along_axis(weight, order, axis=1)
    return order.astype(np.int32), (kept / kept.sum(axis=1, keepdims=True)).astype(np.float32)


def _trunk(frame: Frame, points: Array) -> Array:
    """Weights of pelvis, spine, chest, neck and head by height; the chin belongs to the head."""
    s = frame.scale
    height = {name: frame.joint(name)[2] for name in ("hips", "spine", "chest", "neck", "head")}
    z = points[:, 2]
    front = np.maximum(frame.joint("head")[1] - 0.045 * s - points[:, 1], 0.0)
    low = max(height["spine"], height["hips"] + 0.04 * s)
    steps = (
        np.ones(len(points)),
        _rise(z, low - 0.05 * s, low + 0.07 * s),
        _rise(z, height["chest"] - 0.08 * s, height["chest"] + 0.07 * s),
        _rise(z, height["neck"] - 0.035 * s, height["neck"] + 0.03 * s),
        _rise(z + 2 * front * (z > height["neck"]), height["head"] - 0.03 * s, height["head"] + 0.015 * s),
        np.zeros(len(points)),
    )
    weight = np.zeros((len(points), BONE_COUNT))
    for i, name in enumerate(("pelvis", "spine", "chest", "neck", "head")):
        weight[:, BONE[name]] = np.maximum(steps[i] - steps[i + 1], 0.0)
    return weight


def _arm_share(frame: Frame, points: Array, side: str, sign: float) -> Array:
    s, shoulder = frame.scale, frame.joint(f"{side}_shoulder")
    out = sign * (points[:, 0] - shoulder[0])
    above = _rise(points[:, 2], shoulder[2] - 0.17 * s, shoulder[2] - 0.08 * s)
    below_neck = 1 - _rise(points[:, 2], shoulder[2] + 0.10 * s, shoulder[2] + 0.14 * s)
    return _rise(out, -0.055 * s, 0.05 * s) * np.maximum(above, _rise(out, 0.06 * s, 0.10 * s)) * below_neck


def _clavicle_share(frame: Frame, points: Array, side: str, sign: float) -> Array:
    s, shoulder = frame.scale, frame.joint(f"{side}_shoulder")
    out = _rise(sign * points[:, 0], 0.03 * s, max(sign * shoulder[0] - 0.03 * s, 0.06 * s))
    return 0.85 * out * _rise(points[:, 2], shoulder[2] - 0.16 * s, shoulder[2] - 0.03 * s)


def _arm(weight: Array, frame: Frame, points: Array, side: str, sign: float, share: Array) -> None:
    s = frame.scale
    x = sign * points[:, 0]
    shoulder, elbow, wrist = (sign * frame.joint(f"{side}_{j}")[0] for j in ("shoulder", "elbow", "wrist"))
    fore = _rise(x, elbow - 0.035 * s, elbow + 0.035 * s)
    hand = _rise(x, wrist - 0.018 * s, wrist + 0.014 * s)
    upper_twist = _rise(x, shoulder + 0.03 * s, 0.4 * shoulder + 0.6 * elbow)
    fore_twist = _rise(x, 0.8 * elbow + 0.2 * wrist, wrist)
    for name, part in (
        ("upper_arm", (1 - fore) * (1 - upper_twist)),
        ("upper_arm_end", (1 - fore) * upper_twist),
        ("forearm", (fore - hand) * (1 - fore_twist)),
        ("forearm_end", (fore - hand) * fore_twist),
        ("hand", hand),
    ):
        weight[:, BONE[f"{side}_{name}"]] += share * part


def _leg_share(frame: Frame, points: Array, side: str, sign: float) -> Array:
    s, hip = frame.scale, frame.joint(f"{side}_hip")
    x = sign * points[:, 0]
    groin = hip[2] - 0.015 * s + 0.55 * (x - sign * hip[0])  # the crease rises outwards
    lower = 1 - _rise(points[:, 2], groin - 0.065 * s, groin + 0.065 * s)
    return (
        lower
        * (x > 0)
        * np.maximum(_rise(x, 0.0, 0.03 * s), 1 - _rise(points[:, 2], hip[2] - 0.12 * s, hip[2] - 0.07 * s))
    )


def _leg(weight: Array, frame: Frame, points: Array, side: str, share: Array) -> None:
    s, z = frame.scale, points[:, 2]
    hip, knee, ankle = (frame.joint(f"{side}_{joint}")[2] for joint in ("hip", "knee", "ankle"))
    shin = 1 - _rise(z, knee - 0.05 * s, knee + 0.05 * s)
    foot = 1 - _rise(z, ankle - 0.01 * s, ankle + 0.035 * s)
    twist = 1 - _rise(z, 0.5 * (hip + knee), hip - 0.04 * s)
    for name, part in (
        ("thigh", (1 - shin) * (1 - twist)),
        ("thigh_end", (1 - shin) * twist),
        ("shin", shin - foot * shin),
        ("foot", foot * shin),
    ):
        weight[:, BONE[f"{side}_{name}"]] += share * part

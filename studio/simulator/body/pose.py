"""Bone rotations from joint positions and, where known, joint rotations."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import unit
from studio.engine.model.joints import INDEX, PARENTS
from studio.simulator.body.bones import BONE, BONES
from studio.simulator.body.frame import SIDES

Array = NDArray[np.float64]
_Ways = Callable[[str, str], tuple[Array, Array]]
"""Vector between two joints by name: in the T-pose, shape (3,), and now, shape (F, 3)."""

_SMOOTH_FRAMES = 7.0
"""SD of the smoothing of a limb's twist, in frames of 1/120 s."""

_STRAIGHT = 0.06
"""Weight of zero twist of a limb; a bent joint's twist has weight 1."""


def bone_rotations(
    positions_m: Array, offsets_m: Array, turned: Array | None = None, *, whole_clavicle: bool = False
) -> Array:
    """Return the rotation of every bone of the body from the T-pose, shape (F, BODY_BONES, 3, 3).

    A bone points exactly along its joints. `turned` gives its twist. Without it, and in frames where any of it is
    unknown, upper arms and thighs twist so that elbows and knees bend like hinges.

    Args:
        positions_m: joint centres, shape (F, 21, 3).
        offsets_m: T-pose offsets, shape (21, 3); see `CanonicalMotion`.
        turned: rotations from the T-pose of the bone that starts at each joint, shape (F, 21, 3, 3); NaN = unknown.
        whole_clavicle: clavicles turn fully with the shoulders; by default a little less, like skin.
    """
    if turned is not None:
        known = np.isfinite(turned).all(axis=(1, 2, 3))
        if not known.all():
            out = bone_rotations(positions_m, offsets_m, whole_clavicle=whole_clavicle)
            if known.any():
                out[known] = bone_rotations(
                    positions_m[known], offsets_m, turned[known], whole_clavicle=whole_clavicle
                )
            return out
    frames = len(positions_m)
    rest = np.zeros((len(PARENTS), 3))
    for i, parent in enumerate(PARENTS):
        rest[i] = offsets_m[i] if parent < 0 else rest[parent] + offsets_m[i]
    out = np.empty((frames, len(BONES), 3, 3))

    def way(a: str, b: str) -> tuple[Array, Array]:
        return rest[INDEX[b]] - rest[INDEX[a]], positions_m[:, INDEX[b]] - positions_m[:, INDEX[a]]

    pelvis = _two(way("right_hip", "left_hip"), way("hips", "chest"))
    chest = _two(way("right_shoulder", "left_shoulder"), way("spine", "neck"))
    out[:, BONE["pelvis"]] = pelvis
    out[:, BONE["chest"]] = chest
    out[:, BONE["spine"]] = _swung(_between(pelvis, chest, 0.5), *way("spine", "chest"))
    head = chest if turned is None else turned[:, INDEX["head"]]
    out[:, BONE["head"]] = head
    out[:, BONE["neck"]] = _swung(_between(chest, head, 0.45), *way("neck", "head"))
    for side, _ in SIDES:
        clavicle = _swung(chest, *way("chest", f"{side}_shoulder"))
        out[:, BONE[f"{side}_clavicle"]] = clavicle if whole_clavicle else _between(chest, clavicle, 0.7)
        _arm(out, side, chest, way, turned)
        _leg(out, side, pelvis, way, turned)
    return out


def _arm(out: Array, side: str, chest: Array, way: _Ways, turned: Array | None) -> None:
    upper_way, fore_way = way(f"{side}_shoulder", f"{side}_elbow"), way(f"{side}_elbow", f"{side}_wrist")
    start = _swung(chest, *upper_way)
    if turned is None:
        upper = _hinged(start, upper_way, fore_way, np.array([0.0, -1.0, 0.0]))
        fore = _swung(upper, *fore_way)
        hand = _swung(fore, *way(f"{side}_wrist", f"{side}_hand"))
    else:
        upper = _swung(turned[:, INDEX[f"{side}_shoulder"]], *upper_way)
        fore = _swung(turned[:, INDEX[f"{side}_elbow"]], *fore_way)
        hand = _swung(turned[:, INDEX[f"{side}_wrist"]], *way(f"{side}_wrist", f"{side}_hand"))
        start = _swung(_between(chest, upper, 0.5), *upper_way)
    out[:, BONE[f"{side}_upper_arm"]] = start
    out[:, BONE[f"{side}_upper_arm_end"]] = upper
    out[:, BONE[f"{side}_forearm"]] = fore
    out[:, BONE[f"{side}_forearm_end"]] = _swung(_between(fore, hand, 0.7), *fore_way)
    out[:, BONE[f"{side}_hand"]] = hand


def _leg(out: Array, side: str, pelvis: Array, way: _Ways, turned: Array | None) -> None:
    thigh_way, shin_way = way(f"{side}_hip", f"{side}_knee"), way(f"{side}_knee", f"{side}_ankle")
    foot_way = way(f"{side}_ankle", f"{side}_toe")
    start = _swung(pelvis, *thigh_way)
    if turned is None:
        thigh = _hinged(start, thigh_way, shin_way, np.array([0.0, 1.0, 0.0]))
        shin = _swung(thigh, *shin_way)
        foot = _swung(shin, *foot_way)
    else:
        thigh = _swung(turned[:, INDEX[f"{side}_hip"]], *thigh_way)
        start = _swung(_between(pelvis, thigh, 0.5), *thigh_way)
        shin = _swung(turned[:, INDEX[f"{side}_knee"]], *shin_way)
        foot = _swung(turned[:, INDEX[f"{side}_ankle"]], *foot_way)
    out[:, BONE[f"{side}_thigh"]] = start
    out[:, BONE[f"{side}_thigh_end"]] = thigh
    out[:, BONE[f"{side}_shin"]] = shin
    out[:, BONE[f"{side}_foot"]] = foot


def _axes(first: Array, second: Array) -> Array:
    """Axes whose x is `first` and whose z is near `second`, as columns, shape (..., 3, 3)."""
    x = unit(first)
    y = unit(np.cross(second, x))
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _two(first: tuple[Array, Array], second: tuple[Array, Array]) -> Array:
    """Rotations from rest to now: the first direction exactly, the second by a twist about it."""
    return _axes(first[1], second[1]) @ _axes(first[0], second[0]).T


def _swung(rotation: Array, rest: Array, now: Array) -> Array:
    """`rotation`, then the smallest turn that brings `rest`, shape (3,), to the direction `now`, shape (F, 3)."""
    a, b = unit(rotation @ rest), unit(now)
    axis, cosine = np.cross(a, b), (a * b).sum(-1)[:, None, None]
    k = np.zeros((len(a), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    k[:, 1, 0], k[:, 2, 0], k[:, 2, 1] = axis[:, 2], -axis[:, 1], axis[:, 0]
    return (np.eye(3) + k + k @ k / np.maximum(1 + cosine, 1e-3)) @ rotation


def _between(first: Array, second: Array, share: float) -> Array:
    """Rotations interpolated from the first to the second, shape (F, 3, 3)."""
    way = Rotation.from_matrix(np.swapaxes(first, -1, -2) @ second, assume_valid=True).as_rotvec()
    return first @ Rotation.from_rotvec(share * way).as_matrix()


def _hinged(start: Array, upper: tuple[Array, Array], lower: tuple[Array, Array], bends_to: Array) -> Array:
    """`start` twisted about the upper bone so that the lower one bends towards the T-pose direction `bends_to`.

    A straighter joint has a smaller weight and keeps more of `start`.
    """
    along, below = unit(upper[1]), unit(lower[1])
    aside = below - (below * along).sum(-1, keepdims=True) * along
    bent = np.linalg.norm(aside, axis=-1)
    have = start @ bends_to
    angle = np.arctan2((np.cross(have, aside) * along).sum(-1), (have * aside).sum(-1))
    angle = _smoothly(angle, np.clip((bent - 0.12) / 0.25, 0.0, 1.0))
    return Rotation.from_rotvec(along * angle[:, None]).as_matrix() @ start


def _smoothly(angle: Array, weight: Array) -> Array:
    """`angle` smoothed: follows it where the weight is high and slowly returns to zero where it is low."""
    direction = weight * np.exp(1j * angle) + _STRAIGHT
    parts = [
        gaussian_filter1d(part, _SMOOTH_FRAMES, mode="nearest") for part in (direction.real, direction.imag)
    ]
    steady = np.unwrap(np.arctan2(parts[1], parts[0]))
    return gaussian_filter1d(steady, _SMOOTH_FRAMES, mode="nearest")

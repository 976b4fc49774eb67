"""Targets for a rig's feet and hands, and the bending of its legs and arms to reach them.

Feet: the balls of the feet follow the performer's by the ratio of leg lengths, so that standing feet stand still and
on the floor, whatever the foot's length. Hands keep the performer's directions of the arms, except where they touch
each other, the head, or the floor.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from studio.engine.animation.clip.leg_ik import reach
from studio.engine.animation.retarget.skeleton import Posed
from studio.engine.base.quaternions import multiply, rotate

Array = NDArray[np.float64]
Places = dict[str, Array]
"""Role -> positions, shape (F, 3), or of one pose, shape (3,)."""

STRAIGHT = 0.99
"""Longest stretch of a limb as a share of its length, unless the performer's is straighter."""

LEG = ("UpLeg", "Leg", "Foot")
ARM = ("Arm", "ForeArm", "Hand")

_HEEL_M = 0.02
"""Height of a heel over the ball of the foot, relative to rest, from which only one of the two counts."""

_NEAR_FLOOR_M = (0.05, 0.15)
_EASE_S = 0.1
_HANDS_M = (0.15, 0.5)
_HEAD_M = (0.2, 0.4)
_FLOOR_HAND_M = (0.15, 0.35)
"""Below the first distance, a hand has the performer's place; above the second, the arm has the performer's
direction."""


def smooth_step(values: Array, one: float, zero: float) -> Array:
    """Return 1 at `one` and 0 at `zero`, smoothly between them."""
    t = np.clip((values - zero) / (one - zero), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def length_of(at: Places, side: str, limb: tuple[str, str, str]) -> float:
    """Return the length of a limb in a pose [m]."""
    a, b, c = (at[side + part] for part in limb)
    return float(np.linalg.norm(b - a) + np.linalg.norm(c - b))


def ankle_targets(
    source: Places, source_rest: Places, rig_rest: Places, foot_turn: Array, side: str, ratio: float
) -> Array:
    """Return the target of a rig's ankle [m], shape (F, 3).

    Args:
        source: the motion by role; source_rest, rig_rest: the rest poses, floors at y = 0.
        foot_turn: rotation of the rig's foot from its rest pose, world, shape (F, 4).
        side: Left or Right.
        ratio: of leg lengths, rig to motion.
    """
    foot, toe = f"{side}Foot", f"{side}ToeBase"
    ankle = ratio * source[foot]
    ankle[:, 1] += rig_rest[foot][1] - ratio * source_rest[foot][1]
    if toe not in source or toe not in rig_rest:
        return ankle
    ball = ratio * source[toe]
    ball[:, 1] += rig_rest[toe][1] - ratio * source_rest[toe][1]
    over_ball = ball - rotate(foot_turn, rig_rest[toe] - rig_rest[foot])
    heel_up = (source[foot] - source[toe])[:, 1] - (source_rest[foot] - source_rest[toe])[1]
    share = smooth_step(heel_up, _HEEL_M, -_HEEL_M)
    over_ball[:, 1] = share * over_ball[:, 1] + (1.0 - share) * ankle[:, 1]
    return over_ball


def hips_drop(
    hips: list[Array], targets: list[Array], reaches: list[Array], floors: list[float], hz: float
) -> Array:
    """Return the descent of the hips that lets the legs reach the floor [m], shape (F,), smooth over time.

    Args:
        hips: each leg's hip joint, shape (F, 3); targets: of its ankle; reaches: its longest stretch, shape (F,).
        floors: heights of the ankles at rest [m]; a foot in the air does not lower the hips.
        hz: frames a second.
    """
    need = np.zeros(len(hips[0]))
    for hip, target, reached, floor in zip(hips, targets, reaches, floors, strict=True):
        way = hip - target
        across = np.hypot(way[:, 0], way[:, 2])
        down = way[:, 1] - np.sqrt(np.maximum(reached**2 - across**2, 0.0))
        on_floor = smooth_step(target[:, 1] - floor, *_NEAR_FLOOR_M)
        need = np.maximum(need, on_floor * np.where(across < reached, np.maximum(down, 0.0), 0.0))
    if need.max() < 1e-6:
        return np.zeros_like(need)
    window = 2 * max(1, round(_EASE_S * hz)) + 1
    return uniform_filter1d(maximum_filter1d(need, window, mode="nearest"), window, mode="nearest")


def allowed_reach(
    source: Places, source_rest: Places, rig_rest: Places, side: str, limb: tuple[str, str, str]
) -> Array:
    """Return the largest distance from a limb's root to its end [m], shape (F,), by the performer's straightness."""
    first, _, last = (side + part for part in limb)
    stretched = np.linalg.norm(source[last] - source[first], axis=1) / length_of(source_rest, side, limb)
    return np.clip(stretched, STRAIGHT, 1.0) * length_of(rig_rest, side, limb)


def hand_targets(source: Places, posed: Places, ratio: float, floor_ratio: float) -> dict[str, Array]:
    """Return the targets of hands that touch each other, the head or the floor, by role [m], shape (F, 3).

    Args:
        source: the motion by role.
        posed: the rig, its arms in the performer's directions.
        ratio: of arm spans, rig to motion; floor_ratio: of leg lengths.
    """
    between = np.linalg.norm(source["LeftHand"] - source["RightHand"], axis=1)
    together = smooth_step(between, *_HANDS_M)[:, None]
    middle, rig_middle = ((places["LeftArm"] + places["RightArm"]) / 2 for places in (source, posed))
    out = {}
    for role in ("LeftHand", "RightHand"):
        hand = source[role]
        shift = together * (rig_middle + ratio * (hand - middle) - posed[role])
        weight = together.copy()
        if "Head" in source and "Head" in posed:
            near = smooth_step(np.linalg.norm(hand - source["Head"], axis=1), *_HEAD_M)[:, None]
            shift += near * (posed["Head"] + ratio * (hand - source["Head"]) - posed[role])
            weight += near
        low = smooth_step(hand[:, 1], *_FLOOR_HAND_M)
        shift[:, 1] += low * (floor_ratio * hand[:, 1] - posed[role][:, 1])
        out[role] = posed[role] + shift / np.maximum(weight + low[:, None], 1.0)
    return out


def bend(
    posed: Posed,
    joints: dict[str, int],
    side: str,
    limb: tuple[str, str, str],
    target: Array,
    axis: Array,
    far: Array,
) -> Posed:
    """Return the rig with a limb bent so that its end is at a target; the end keeps its own rotation.

    Args:
        posed: the rig.
        joints: role -> bone.
        side, limb: which.
        target: of the end [m], shape (F, 3).
        axis: of the middle joint where the limb is straight, in the T-pose, shape (3,).
        far: largest distance of the end from the root [m], shape (F,).
    """
    positions, turns = posed.place()
    first, middle, last = (joints[side + part] for part in limb)
    start, end = positions[:, first], positions[:, last]
    way = target - start
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    limit = np.maximum(far, np.minimum(np.linalg.norm(end - start, axis=1), distance[:, 0]))[:, None]
    target = start + way * np.minimum(1.0, limit / np.maximum(distance, 1e-9))
    upper, lower = reach(start, positions[:, middle], end, target, axis, soft=False)
    changed = {
        first: multiply(upper.as_quat(scalar_first=True), turns[:, first]),
        middle: multiply(lower.as_quat(scalar_first=True), turns[:, middle]),
        last: turns[:, last],
    }
    return replace(posed, turns={**posed.turns, **changed})

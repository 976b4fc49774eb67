"""Several motions on one stage: one performer walks for the calibration, all hold a T-pose, then they perform.

The pose changes abruptly between the parts, as in joined recordings. In each motion the path of the meeting replaces
the slow path over the floor; the steps stay.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.animation.motion.authored import calibration_motion
from studio.engine.animation.motion.keys import RATE_HZ
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.model.joints import INDEX, JOINT_COUNT, PARENTS
from studio.simulator.crowd.lifting import with_lifted_arm

T_POSE_S = 3.0
"""Duration of the T-pose side by side."""

_ASIDE_M = 1.0
"""Half the distance between neighbours in the T-pose, so that their hands do not touch."""
GOING_S = 1.0
"""Time to glide from the walk to the T-pose, and from there to the performance, without a jump."""

_STEPS_S = 0.3
"""SD of the smoothing that gives the hips' path over the floor."""

_Array = NDArray[np.float64]
Placing = Callable[[int, int, _Array], tuple[_Array, _Array]]
"""Performer, number of performers, times [s] -> places on the floor [m], (F, 2), and headings [rad], (F,)."""


def _apart(who: int, count: int, times: _Array) -> tuple[_Array, _Array]:
    side = 2 * _ASIDE_M * (who - (count - 1) / 2)
    return np.tile([side, 0.0], (len(times), 1)), np.zeros(len(times))


def _passing(who: int, count: int, times: _Array) -> tuple[_Array, _Array]:
    """All change places every 3.5 s, in lanes half a metre apart."""
    side = _apart(who, count, times)[0][:, 0] * np.cos(2 * np.pi * times / 7.0)
    return np.stack([side, np.full(len(times), 0.5 * (who - (count - 1) / 2))], axis=1), np.zeros(len(times))


def _side(who: int, count: int) -> float:
    """Return the angle of a performer's place about the middle [rad]; the first is at -x, as in the T-pose."""
    return np.pi * (1.0 - 2.0 * who / count)


def _circling(who: int, count: int, times: _Array) -> tuple[_Array, _Array]:
    """All circle the middle in 6 s, facing outwards."""
    angle = 2 * np.pi * times / 6.0 + _side(who, count)
    radius = 0.6 if count < 3 else 0.9
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), angle + np.pi / 2


def _back_to_back(who: int, count: int, times: _Array) -> tuple[_Array, _Array]:
    angle = _side(who, count)
    place = 0.3 * np.array([np.cos(angle), np.sin(angle)])
    return np.tile(place, (len(times), 1)), np.full(len(times), angle + np.pi / 2)


def _embracing(who: int, count: int, times: _Array) -> tuple[_Array, _Array]:
    """All approach and part every 5 s, facing the middle."""
    angle = _side(who, count)
    far = 0.45 + 0.25 * np.cos(2 * np.pi * times / 5.0)
    return far[:, None] * [np.cos(angle), np.sin(angle)], np.full(len(times), angle - np.pi / 2)


def _side_by_side(who: int, count: int, times: _Array) -> tuple[_Array, _Array]:
    """Pairs stand side by side and turn once in 8 s; the pairs stand behind one another."""
    turn = 2 * np.pi * times / 8.0
    pair, pairs = who // 2, (count + 1) // 2
    aside = (0.4 if who % 2 else -0.4) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    behind = np.array([0.0, 1.2 * (pair - (pairs - 1) / 2)])
    return aside + behind, turn


MEETINGS: dict[str, Placing] = {
    "apart": _apart,
    "passing": _passing,
    "circling": _circling,
    "back-to-back": _back_to_back,
    "embracing": _embracing,
    "lifting": _side_by_side,
}


@dataclass(frozen=True)
class Meeting:
    """Performers on one stage.

    Attributes:
        motions: one per performer, from time 0, all of the same length.
        enters_s: entrance of each [s]; absent before it.
        calibration_s: length of the part in which the first is alone.
    """

    motions: tuple[CanonicalMotion, ...]
    enters_s: tuple[float, ...]
    calibration_s: float


def meet(motions: Sequence[CanonicalMotion], meeting: str) -> Meeting:
    """Return the motions on one stage.

    Args:
        motions: one per performer, at 120 Hz, on the floor; the shortest sets the duration.
        meeting: a key of `MEETINGS`.
    """
    count = len(motions)
    performing = min(motion.frame_count for motion in motions)
    holding = round(T_POSE_S * RATE_HZ)
    walk = calibration_motion(motions[0].offsets_m).positions_m
    placed = []
    times = np.arange(performing) / RATE_HZ
    ways = [MEETINGS[meeting](who, count, times) for who in range(count)]
    acted = [_moved(motion.positions_m[:performing], *way) for motion, way in zip(motions, ways, strict=True)]
    if meeting == "lifting":
        for k in range(0, count - 1, 2):
            acted[k : k + 2] = with_lifted_arm(acted[k], acted[k + 1])
    for who, motion in enumerate(motions):
        before = walk if who == 0 else np.repeat(_t_pose(motion.offsets_m)[None], len(walk), axis=0)
        t_pose = _t_pose(motion.offsets_m)
        aside = _apart(who, count, np.zeros(1))[0][0]
        ends = before[-1, INDEX["hips"], :2] if who == 0 else aside
        held = [
            _going(t_pose, ends, aside),
            _at(t_pose, np.tile(aside, (holding, 1))),
            _going(t_pose, aside, ways[who][0][0]),
        ]
        positions = np.concatenate([before, *held, acted[who]])
        placed.append(replace(motion, positions_m=positions, hands_open=np.ones((len(positions), 2))))
    calibration_s = len(walk) / RATE_HZ
    comes_in_s = calibration_s + GOING_S  # once the first has made room
    return Meeting(tuple(placed), (0.0, *[comes_in_s] * (count - 1)), calibration_s)


def _t_pose(offsets: _Array) -> _Array:
    """Return the joints of a T-pose over the stage's origin [m], shape (21, 3)."""
    joints = np.zeros((JOINT_COUNT, 3))
    for joint in range(JOINT_COUNT):  # parents come first
        joints[joint] = offsets[joint] + (joints[PARENTS[joint]] if PARENTS[joint] >= 0 else 0.0)
    return joints


def _at(pose: _Array, places: _Array) -> _Array:
    """Return a pose, shape (21, 3), at places on the floor, shape (F, 2)."""
    return pose + np.concatenate([places, np.zeros((len(places), 1))], axis=1)[:, None]


def _going(pose: _Array, begin: _Array, end: _Array) -> _Array:
    """Return a pose that glides over the floor from one place to another."""
    share = (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, round(GOING_S * RATE_HZ)))) / 2.0
    return _at(pose, begin + share[:, None] * (end - begin))


def _moved(positions: _Array, places: _Array, headings: _Array) -> _Array:
    """Return the motion with its path over the floor replaced."""
    way = gaussian_filter1d(positions[:, INDEX["hips"], :2], _STEPS_S * RATE_HZ, axis=0, mode="nearest")
    local = positions - np.concatenate([way, np.zeros((len(way), 1))], axis=1)[:, None]
    cos, sin = np.cos(headings)[:, None], np.sin(headings)[:, None]
    out = local.copy()
    out[..., 0] = cos * local[..., 0] - sin * local[..., 1] + places[:, :1]
    out[..., 1] = sin * local[..., 0] + cos * local[..., 1] + places[:, 1:]
    return out

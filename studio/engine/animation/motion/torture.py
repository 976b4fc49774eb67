"""Motions in which solvers lose limbs: limbs straightened again and again, arms with joints that hide each other,
turns, a cartwheel. They are built of canonical joints, for a body with its own proportions.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.animation.motion.composer import compose
from studio.engine.animation.motion.keys import RATE_HZ, FloorPath, Keys
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS, TOE_HEIGHT_M
from studio.engine.model.joints import INDEX

Array = NDArray[np.float64]
_SIDES = ("left", "right")
_QUARTER = np.pi / 2
_HANG = {"raise": 0.15, "plane": 0.0, "roll": 0.0, "elbow": 0.2}
_START_S = 1.0
_GROUND = [INDEX[f"{side}_{joint}"] for side in _SIDES for joint in ("hand", "toe")]


def _body() -> Array:
    """Offsets of a shorter body with broad hips, long legs and short forearms."""
    offsets = 0.94 * AUTHORED_OFFSETS
    for side in _SIDES:
        offsets[INDEX[f"{side}_hip"], 0] *= 1.12
        offsets[INDEX[f"{side}_shoulder"], 0] *= 0.95
        offsets[INDEX[f"{side}_knee"], 2] *= 1.05
        offsets[INDEX[f"{side}_wrist"], 0] *= 0.93
    offsets[0, 2] -= 0.05 * offsets[INDEX["left_knee"], 2] / 1.05
    offsets[0, 2] += TOE_HEIGHT_M * (1 - 0.94)
    return offsets


TORTURE_OFFSETS: Array = _body()
"""T-pose offsets of this body, shape (21, 3) [m]; see `CanonicalMotion`."""


def _both(values: dict[str, float]) -> dict[str, float]:
    return {f"{side}_{name}": value for side in _SIDES for name, value in values.items()}


class _Course:
    """Successive poses on the spot."""

    def __init__(self) -> None:
        self.keys, self.now = Keys(), 0.0
        self.keys.move(0.0, 0.0, **_both(_HANG))
        self.to(_START_S, **_both(_HANG))

    def to(self, duration_s: float, **values: float) -> None:
        self.keys.move(self.now, self.now + duration_s, **values)
        self.now += duration_s

    def hold(self, duration_s: float) -> None:
        self.now += duration_s

    def motion(self, path: FloorPath | None = None) -> CanonicalMotion:
        return compose(TORTURE_OFFSETS, self.keys, path or FloorPath(), self.now)


def arm_bent(times: int) -> CanonicalMotion:
    """Straighten and bend both arms `times` times at two a second: hanging, forwards, aside and overhead."""
    course = _Course()
    places = ((0.2, 0.3), (1.5, 1.5), (1.5, 0.0), (2.8, 0.4))  # raise, plane
    for k in range(times):
        raise_, plane = places[k * len(places) // times]
        course.to(0.25, **_both({"raise": raise_, "plane": plane, "elbow": 2.0}))
        course.to(0.25, **_both({"elbow": 0.0}))
    course.to(0.8, **_both(_HANG))
    return course.motion()


def leg_bent(times: int) -> CanonicalMotion:
    """Kick the left leg straight and bend it `times` times, standing on the right one: hanging, then lifted
    forwards."""
    keys = Keys()
    for k in range(times):
        start = _START_S + 0.7 * k
        keys.move(start, start + 0.35, thigh=0.5 if k % 2 else 1.1, knee=1.7)
        keys.move(start + 0.35, start + 0.7, thigh=0.1 if k % 2 else 0.8, knee=0.0)
    end = _START_S + 0.7 * times
    keys.move(end, end + 0.6, thigh=0.0, knee=0.0)
    course = _Course()
    course.hold(end + 1.0 - course.now)
    motion = course.motion()
    at = motion.times_s()
    positions = motion.positions_m.copy()
    _leg(positions, "left", keys.sample("thigh", at), keys.sample("knee", at), 0.03)
    return replace(motion, positions_m=positions)


def arms_crossed() -> CanonicalMotion:
    """Arms folded before the chest and opened again."""
    course = _Course()
    for _ in range(3):
        fold = {"raise": 0.6, "plane": 1.0, "roll": 1.15, "elbow": 1.7}
        course.to(0.9, **{f"left_{n}": v for n, v in fold.items()})
        course.to(0.3, **{f"right_{n}": v + 0.12 * (n == "raise") for n, v in fold.items()})
        course.hold(1.0)
        course.to(0.8, **_both(_HANG))
    return course.motion()


def hands_behind_back() -> CanonicalMotion:
    """Hands brought together behind the back, held and brought back.

    They go 0.11 m deep into the trunk. Finishing keeps parts of the body apart and moves them out,
    so it is 4 mm further from these joints.
    """
    course = _Course()
    for _ in range(3):
        course.to(0.4, **_both({"raise": -0.3, "plane": 1.3, "elbow": 0.5}))
        course.to(0.5, **_both({"roll": 1.3, "elbow": 1.3}))
        course.hold(1.0)
        course.to(0.5, **_both({"roll": 0.3, "elbow": 0.5}))
        course.to(0.5, **_both(_HANG))
    return course.motion()


def slow_turn() -> CanonicalMotion:
    """A full turn to the left in steps, and back."""
    course, path = _Course(), FloorPath()
    path.wait(_START_S)
    for yaw in (2 * np.pi, 0.0):
        path.turn(yaw, 4.5)
        path.wait(1.0)
    course.hold(path.end_s - course.now)
    return course.motion(path)


def fast_turn() -> CanonicalMotion:
    """Two pirouettes on tiptoe with the arms half in, a turn in 0.9 s each."""
    course = _Course()
    course.to(0.6, **_both({"raise": 0.9, "plane": 0.8, "elbow": 1.2}), tiptoe=0.4)
    turns = Keys()
    for k in range(2):
        turns.move(course.now, course.now + 0.9, yaw=(k + 1) * 2 * np.pi)
        course.hold(1.3)
    course.to(0.8, **_both(_HANG), tiptoe=0.0)
    motion = course.motion()
    yaw = turns.sample("yaw", motion.times_s())
    c, s, zero = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    turn = np.stack([c, -s, zero, s, c, zero, zero, zero, zero + 1], axis=-1).reshape(-1, 3, 3)
    return replace(motion, positions_m=np.einsum("fab,fjb->fja", turn, motion.positions_m))


def cartwheel() -> CanonicalMotion:
    """A cartwheel to the left in 2 s, on straight arms and spread straight legs, and one back."""
    course = _Course()
    course.to(1.0, **_both({"raise": 2.6, "elbow": 0.0}))
    wheel, spread = Keys(), Keys()
    spread.move(0.6, 1.6, aside=0.03)
    for turns in (1, 0):
        wheel.move(course.now, course.now + 2.0, turn=turns * 2 * np.pi)
        spread.move(course.now, course.now + 0.4, aside=0.55)
        course.hold(2.0)
        spread.move(course.now - 0.4, course.now, aside=0.03)
        course.hold(0.8)
    course.to(1.0, **_both(_HANG))
    motion = course.motion()
    at = motion.times_s()
    positions = motion.positions_m.copy()
    zero, aside = np.zeros_like(at), np.maximum(spread.sample("aside", at), 0.03)
    for side in _SIDES:
        _leg(positions, side, zero, zero, aside)
    return replace(motion, positions_m=_rolled(positions, wheel.sample("turn", at)))


def arms_circling() -> CanonicalMotion:
    """Straight arms swung up before the body and down beside it, then circled overhead."""
    course = _Course()
    course.to(0.5, **_both({"raise": 0.2, "plane": 1.5, "roll": 0.0, "elbow": 0.0}))
    for _ in range(4):
        course.to(0.55, **_both({"raise": 2.85}))
        course.to(0.25, **_both({"plane": 0.1}))
        course.to(0.55, **_both({"raise": 0.2}))
        course.to(0.25, **_both({"plane": 1.5}))
    course.to(0.6, **_both({"raise": 2.8}))
    for _ in range(4):
        for raise_, plane in ((2.2, 1.1), (2.2, 0.2), (2.9, 0.2), (2.9, 1.1)):
            course.to(0.25, **_both({"raise": raise_, "plane": plane}))
    course.to(0.9, **_both(_HANG))
    return course.motion()


def punches() -> CanonicalMotion:
    """From the T-pose, straight arms brought forwards and back, then punches straight forwards."""
    course = _Course()
    out = {"raise": _QUARTER, "plane": 0.0, "roll": 0.0, "elbow": 0.0}
    course.to(0.6, **_both(out))
    for _ in range(3):
        course.to(0.4, **_both({"plane": _QUARTER}))
        course.to(0.4, **_both({"plane": 0.0}))
    guard = {"raise": 0.6, "plane": 1.2, "roll": 0.4, "elbow": 2.2}
    course.to(0.5, **_both(guard))
    for k in range(8):
        side = _SIDES[k % 2]
        reach = {"raise": 1.5, "plane": 1.55, "roll": 0.8, "elbow": 0.0}
        course.to(0.22, **{f"{side}_{n}": v for n, v in reach.items()}, twist=(-0.4, 0.4)[k % 2])
        course.to(0.28, **{f"{side}_{n}": v for n, v in guard.items()}, twist=0.0)
    course.to(0.5, **_both(out))
    course.to(0.8, **_both(_HANG))
    return course.motion()


TORTURES: dict[str, Callable[[], CanonicalMotion]] = {
    "arm_bent": lambda: arm_bent(20),
    "leg_bent": lambda: leg_bent(20),
    "arms_crossed": arms_crossed,
    "hands_behind_back": hands_behind_back,
    "slow_turn": slow_turn,
    "fast_turn": fast_turn,
    "cartwheel": cartwheel,
    "arms_circling": arms_circling,
    "punches": punches,
}
"""By name, in their short form."""


def _leg(positions: Array, side: str, thigh: Array, knee: Array, aside: Array | float) -> None:
    """Set one leg, in place, of a body that faces -y: thigh forwards, knee bent, leg spread [rad], shape (F,)."""
    lengths = [np.linalg.norm(TORTURE_OFFSETS[INDEX[f"{side}_{joint}"]]) for joint in ("knee", "ankle")]
    toe_back, toe_down = -TORTURE_OFFSETS[INDEX[f"{side}_toe"], 1:]
    spread = np.broadcast_to(aside, thigh.shape) * (1.0 if side == "left" else -1.0)

    def along(forwards: Array, down: float = 1.0, ahead: float = 0.0) -> Array:
        """A direction in the leg's plane: `down` along the leg, `ahead` perpendicular to it."""
        fall = down * np.cos(forwards) - ahead * np.sin(forwards)
        reach = down * np.sin(forwards) + ahead * np.cos(forwards)
        return np.stack([fall * np.sin(spread), -reach, -fall * np.cos(spread)], axis=-1)

    at = positions[:, INDEX[f"{side}_hip"]]
    for joint, step in (
        ("knee", lengths[0] * along(thigh)),
        ("ankle", lengths[1] * along(thigh - knee)),
        ("toe", along(thigh - knee, float(toe_down), float(toe_back))),
    ):
        at = at + step
        positions[:, INDEX[f"{side}_{joint}"]] = at


def _rolled(positions: Array, turn: Array) -> Array:
    """The body, shape (F, 21, 3), rolled to its left by `turn` [rad] over the lowest hand or foot."""
    middle = positions[:, :1]
    c, s, zero = np.cos(turn), np.sin(turn), np.zeros_like(turn)
    rotation = np.stack([c, zero, s, zero, zero + 1, zero, -s, zero, c], axis=-1).reshape(-1, 3, 3)
    body = np.einsum("fab,fjb->fja", rotation, positions - middle)
    ends = body[:, _GROUND]
    share = np.exp(-(ends[..., 2] - ends[..., 2].min(axis=1, keepdims=True)) / 0.08)
    share /= share.sum(axis=1, keepdims=True)
    height = TOE_HEIGHT_M - (share * ends[..., 2]).sum(axis=1)
    slip = (0.5 * (share[1:] + share[:-1])[..., None] * np.diff(ends, axis=0)).sum(axis=1)
    place = np.zeros((len(body), 3))
    place[1:, :2] = -np.cumsum(slip[:, :2], axis=0)
    place[:, :2] += middle[0, 0, :2] - 0.5 * (place[:, :2].min(axis=0) + place[:, :2].max(axis=0))
    place[:, 2] = height
    return body + gaussian_filter1d(place, 0.04 * RATE_HZ, axis=0, mode="nearest")[:, None]

"""The authored motions: the calibration walk for any body, and the motions of the embedded performer.

To make one takes a tenth of a second, so the last ones are kept: nobody changes their arrays.
"""

from collections.abc import Callable
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.composer import compose
from studio.engine.animation.motion.keys import FloorPath, Jump, Keys
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.model.joints import INDEX

_KEPT = 4
T_POSE_S = 3.0
WALK_S = 30.0
_SIDES = ("left", "right")
_QUARTER = np.pi / 2
_CLEAR = 0.2
"""Angle of swinging arms at the thighs; straight down, hands would go through them."""

_RELAXED = {"raise": 0.14, "plane": 0.0, "roll": 0.0, "elbow": 0.22}
_T_POSE = {"raise": _QUARTER, "plane": 0.0, "roll": 0.0, "elbow": 0.0}
_WALK_POINTS: tuple[tuple[float, float], ...] = (
    (0.0, -1.2), (0.0, 1.2), (1.3, 0.1), (-1.3, 0.0), (-0.9, -1.0), (1.0, 1.0), (0.9, -1.0), (0.0, 0.0),
)  # fmt: skip


def _both(values: dict[str, float]) -> dict[str, float]:
    return {f"{side}_{name}": value for side in _SIDES for name, value in values.items()}


class _Script:
    """Builds a motion part by part; the body's path and its channels share one clock."""

    def __init__(self) -> None:
        self.keys = Keys()
        self.path = FloorPath()
        self.now = 0.0

    def to(self, duration_s: float, **values: float) -> None:
        """Move channels to new values without walking."""
        self.keys.move(self.now, self.now + duration_s, **values)
        self.now += duration_s
        self.path.wait(self.now - self.path.end_s)

    def hold(self, duration_s: float) -> None:
        self.now += duration_s
        self.path.wait(duration_s)

    def t_pose(self) -> None:
        """Start in the T-pose and hold it."""
        self.keys.move(0.0, 0.0, **_both(_T_POSE))
        self.hold(T_POSE_S)

    def relax(self, duration_s: float = 0.8) -> None:
        self.to(duration_s, **_both(_RELAXED))

    def travel(self, go: Callable[[FloorPath], None]) -> None:
        """Extend the path, with the arms swinging."""
        self.hold(0.2)
        start = self.now
        go(self.path)
        self.path.wait(0.9)  # the last step
        self.now = self.path.end_s
        self.keys.move(start, start + 0.4, swing=1.0)
        self.keys.move(self.now - 0.5, self.now, swing=0.0)


def calibration_motion(offsets: NDArray[np.float64]) -> CanonicalMotion:
    """Return the motion for calibration: 3 s of T-pose, then 30 s of walking both axes and turning.

    Args:
        offsets: T-pose offsets of any body [m], shape (21, 3); see `CanonicalMotion`.
    """
    return _calibration_motion(np.asarray(offsets, dtype=np.float64).tobytes())


@lru_cache(maxsize=_KEPT)
def _calibration_motion(body: bytes) -> CanonicalMotion:
    offsets = _offsets_of(body)
    leg = float(np.linalg.norm(offsets[[INDEX["left_knee"], INDEX["left_ankle"]]], axis=-1).sum())
    size = float(np.clip(leg / 0.85, 0.5, 1.2))
    script = _Script()
    script.t_pose()
    script.relax()
    points = [(size * x, size * y) for x, y in _WALK_POINTS]
    script.travel(lambda path: path.walk(points, speed_m_s=1.05 * size))
    script.path.turn(round(script.path.yaws[-1] / (2 * np.pi)) * 2 * np.pi)
    script.path.wait(max(T_POSE_S + WALK_S - script.path.end_s, 0.0))
    return compose(offsets, script.keys, script.path, T_POSE_S + WALK_S)


def demo_motion(offsets: NDArray[np.float64] = AUTHORED_OFFSETS, *, begins_with: int = 0) -> CanonicalMotion:
    """Return the embedded performer's motion, which loops: it ends in the pose and place of its start.

    T-pose, walking both axes, arm swings front to back and up and down, arm circles, punches, a squat, a jump
    and a full turn.

    Args:
        offsets: T-pose offsets of any body [m], shape (21, 3).
        begins_with: which of the movements, from 0, comes first after the T-pose; those before it come last.
    """
    return _demo_motion(np.asarray(offsets, dtype=np.float64).tobytes(), begins_with)


@lru_cache(maxsize=_KEPT)
def _demo_motion(body: bytes, begins_with: int) -> CanonicalMotion:
    script = _Script()
    script.t_pose()
    script.relax()
    parts = (_walk, _front_back, _up_down, _circles, _punches, _squat, _jump)
    first = begins_with % len(parts)
    for part in (*parts[first:], *parts[:first]):
        part(script)
    script.travel(lambda path: path.turn(path.yaws[-1] + 2 * np.pi, 4.5))
    script.to(1.0, **_both(_T_POSE))
    return compose(_offsets_of(body), script.keys, script.path, script.now)


def _offsets_of(body: bytes) -> NDArray[np.float64]:
    return np.frombuffer(body).reshape(-1, 3).copy()


@cache
def stage_motion() -> CanonicalMotion:
    """Return the embedded performer's motion for the live stage, which loops from T-pose to T-pose.

    It has the movements of `demo_motion`, with a T-pose held between them, so that a calibration sees one soon.
    """
    script = _Script()
    script.t_pose()
    script.relax()
    for part, points in zip(_STAGE_PARTS, _STAGE_WALKS, strict=True):
        _walk_to(script, points)
        part(script)
        script.to(0.8, **_both(_T_POSE))
        script.hold(T_POSE_S)
        script.relax()
    script.travel(lambda path: path.turn(path.yaws[-1] + 2 * np.pi, 4.5))
    script.to(1.0, **_both(_T_POSE))
    return compose(AUTHORED_OFFSETS, script.keys, script.path, script.now)


def movement(name: str) -> CanonicalMotion:
    """Return one of the thesis's four movements of the arms (`MOVEMENTS`), repeated in one place."""
    part, times = MOVEMENTS[name]
    script = _Script()
    script.keys.move(0.0, 0.0, **_both(_RELAXED))
    if part is _front_back:
        script.keys.move(0.0, 0.0, **_both({"spread": _CLEAR}))
    script.hold(0.5)
    for _ in range(times):
        part(script)
    script.hold(0.5)
    return compose(AUTHORED_OFFSETS, script.keys, script.path, script.now)


def _walk(script: _Script) -> None:
    _walk_to(script, [(0.0, -1.1), (0.0, 1.0), (1.1, 0.2), (-1.2, 0.2), (0.0, 0.0)])


def _walk_to(script: _Script, points: list[tuple[float, float]]) -> None:
    """Walk from point to point, and turn to the front."""
    script.travel(lambda path: path.walk(points, speed_m_s=1.05))
    front = round(script.path.yaws[-1] / (2 * np.pi)) * 2 * np.pi
    script.travel(lambda path: path.turn(front))


def _front_back(script: _Script) -> None:
    script.to(0.3, left_plane=_QUARTER, right_plane=_QUARTER)
    for forward in (1.5, -0.6, 1.5, -0.6, 1.5):
        script.to(0.75, left_raise=forward, right_raise=forward)
    script.relax()


def _up_down(script: _Script) -> None:
    for height in (2.7, 0.14, 2.7, 0.14):
        script.to(1.0, **_both({"raise": height, "elbow": 0.1}))
    script.relax(0.4)


def _circles(script: _Script) -> None:
    """Arms out, circling: height and depth a quarter of a turn apart."""
    script.to(0.8, **_both(_T_POSE))
    start, period, turns = script.now, 1.4, 4
    for side in _SIDES:
        for k in range(2 * turns):
            at = start + k * period / 2
            script.keys.move(at, at + period / 2, **{f"{side}_raise": _QUARTER + (0.4, -0.4)[k % 2]})
            at += period / 4
            script.keys.move(at, at + period / 2, **{f"{side}_plane": (0.45, -0.25)[k % 2]})
    script.hold((turns + 0.25) * period)
    script.relax()


def _punches(script: _Script) -> None:
    guard = {"raise": 0.55, "plane": 1.2, "roll": 0.5, "elbow": 2.2}
    script.to(0.7, **_both(guard | {"fist": 1.0}), drop=0.05)
    for k in range(6):
        side, sign = (("left", -1.0), ("right", 1.0))[k % 2]
        out = {f"{side}_raise": 1.5, f"{side}_plane": 1.65, f"{side}_elbow": 0.12, f"{side}_roll": 0.9}
        script.to(0.28, twist=0.45 * sign, **out)
        script.hold(0.05)
        script.to(0.34, twist=0.0, **{f"{side}_{name}": value for name, value in guard.items()})
        script.hold(0.1)
    script.to(0.5, **_both({"fist": 0.0}), drop=0.0)
    script.relax()


def _squat(script: _Script) -> None:
    arms = _both({"raise": 1.45, "plane": 1.5, "elbow": 0.1})
    script.to(1.3, drop=0.38, back=0.16, lean=0.45, bend=0.2, nod=-0.3, **arms)
    script.hold(0.4)
    script.to(1.2, drop=0.0, back=0.0, lean=0.0, bend=0.0, nod=0.0, **_both(_RELAXED))


def _jump(script: _Script) -> None:
    """Crouch, push off with the arms, fly, land softly."""
    crouch = 0.25
    script.to(0.7, drop=crouch, back=0.08, lean=0.4, **_both({"raise": -0.5, "plane": _QUARTER}))
    jump = Jump(script.now + 0.3, height_m=0.28, push_m=crouch + 0.06)
    script.keys.jumps.append(jump)
    reach = _both({"raise": 1.9, "plane": _QUARTER})
    script.keys.move(script.now, jump.take_off_s, back=0.0, lean=0.05, tiptoe=0.6, **reach)
    landed = jump.take_off_s + jump.flight_s
    script.keys.move(landed, landed + 0.2, tiptoe=0.0)
    script.keys.move(landed - 0.1, landed + jump.push_s, back=0.06, lean=0.35, **_both({"raise": 0.7}))
    script.hold(landed + jump.push_s - script.now)
    script.to(0.8, drop=0.0, back=0.0, lean=0.0, **_both(_RELAXED))


_STAGE_PARTS = (_front_back, _up_down, _circles, _punches, _squat, _jump)
_STAGE_WALKS = (
    [(0.0, -1.1), (0.9, -0.6)], [(-1.0, -0.8), (-1.1, 0.6)], [(0.3, 1.0), (1.1, 0.9)],
    [(1.1, -0.9), (0.2, -1.1)], [(-1.1, 0.0)], [(0.4, 1.0), (0.0, 0.0)],
)  # fmt: skip
"""Walk before each part on the live stage."""

MOVEMENTS: dict[str, tuple[Callable[[_Script], None], int]] = {
    "arms_front_back": (_front_back, 2),
    "arms_up_down": (_up_down, 2),
    "arm_circles": (_circles, 1),
    "punches": (_punches, 1),
}
"""The movements that the thesis measured (5.6): the part, and its number of repetitions."""

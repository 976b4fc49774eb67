"""Motions that are hard for a tracker with one camera, for any performer; they begin with a T-pose."""

from collections.abc import Callable

import numpy as np

from studio.engine.animation.motion.composer import compose
from studio.engine.animation.motion.keys import FloorPath, Keys
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.simulator.body.performers import DEFAULT
from studio.simulator.body.proportions import performer_offsets

_SIDES = ("left", "right")
_T_POSE = {"raise": np.pi / 2, "plane": 0.0, "roll": 0.0, "elbow": 0.0}
_HANG = {"raise": 0.14, "plane": 0.0, "roll": 0.0, "elbow": 0.22}
T_POSE_S = 2.0


def _both(values: dict[str, float]) -> dict[str, float]:
    return {f"{side}_{name}": value for side in _SIDES for name, value in values.items()}


class _Scene:
    """T-pose, then arms down; more parts can be appended."""

    def __init__(self) -> None:
        self.keys, self.path, self.now = Keys(), FloorPath(), T_POSE_S
        self.keys.move(0.0, 0.0, **_both(_T_POSE))
        self.to(0.8, **_both(_HANG))
        self.hold(0.4)

    def to(self, duration_s: float, **values: float) -> None:
        self.keys.move(self.now, self.now + duration_s, **values)
        self.hold(duration_s)

    def hold(self, duration_s: float) -> None:
        self.now += duration_s
        self.path.wait(self.now - self.path.end_s)

    def travel(self, go: Callable[[FloorPath], None]) -> None:
        go(self.path)
        start, self.now = self.now, self.path.end_s
        self.keys.move(start, start + 0.4, swing=1.0)
        self.keys.move(self.now, self.now + 0.4, swing=0.0)
        self.hold(1.0)

    def motion(self) -> CanonicalMotion:
        return compose(performer_offsets(DEFAULT), self.keys, self.path, self.now)


def full_turn() -> CanonicalMotion:
    """A full turn on the spot in steps, and back."""
    scene = _Scene()
    scene.travel(lambda path: path.turn(2 * np.pi, 4.5))
    scene.travel(lambda path: path.turn(0.0, 4.5))
    return scene.motion()


def arms_crossed() -> CanonicalMotion:
    """Arms folded before the chest, held and opened again, twice."""
    scene = _Scene()
    under = {"raise": 0.5, "plane": 1.5, "roll": 1.4, "elbow": 1.6}
    over = {"raise": 0.7, "plane": 1.5, "roll": 1.15, "elbow": 1.6}
    for _ in range(2):
        scene.to(0.8, **{f"left_{name}": value for name, value in under.items()})
        scene.to(0.6, **{f"right_{name}": value for name, value in over.items()})
        scene.hold(1.2)
        scene.to(0.8, **_both(_HANG))
        scene.hold(0.6)
    return scene.motion()


def hands_behind_back() -> CanonicalMotion:
    """Hands brought together behind the back, held and brought back, twice."""
    scene = _Scene()
    for _ in range(2):
        scene.to(0.4, **_both({"raise": -0.3, "plane": 1.3, "elbow": 0.5}))
        scene.to(0.5, **_both({"roll": 1.3, "elbow": 1.3}))
        scene.hold(1.2)
        scene.to(0.5, **_both({"roll": 0.3, "elbow": 0.5}))
        scene.to(0.5, **_both(_HANG))
        scene.hold(0.6)
    return scene.motion()


def crouch() -> CanonicalMotion:
    """Down to a deep crouch with the arms before the knees, and up, twice."""
    scene = _Scene()
    for _ in range(2):
        scene.to(
            1.1, drop=0.42, back=0.14, lean=0.5, bend=0.25, nod=-0.3, **_both({"raise": 0.9, "plane": 1.4})
        )
        scene.hold(1.0)
        scene.to(1.1, drop=0.0, back=0.0, lean=0.0, bend=0.0, nod=0.0, **_both(_HANG))
        scene.hold(0.6)
    return scene.motion()


def leaves_and_returns() -> CanonicalMotion:
    """Walks out of a frontal camera's view to the side, waits, and comes back."""
    scene = _Scene()
    scene.travel(lambda path: path.walk([(3.4, 0.2)], speed_m_s=1.1))
    scene.travel(lambda path: path.walk([(0.0, 0.0)], speed_m_s=1.1))
    scene.travel(lambda path: path.turn(round(path.yaws[-1] / (2 * np.pi)) * 2 * np.pi))
    return scene.motion()


SCENES: dict[str, Callable[[], CanonicalMotion]] = {
    "full_turn": full_turn,
    "arms_crossed": arms_crossed,
    "hands_behind_back": hands_behind_back,
    "crouch": crouch,
    "leaves_and_returns": leaves_and_returns,
}
"""The hard motions by name."""

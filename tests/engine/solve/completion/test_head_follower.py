"""Heads that follow their faces: turns are recovered; an unseen head returns to straight."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.human.face import EARS, LANDMARKS, MIRROR, NAMES, PLACES_M
from studio.engine.solve.completion.head_follower import FORGET_S, HeadFollower, HeadStep, smoothed
from studio.engine.solve.completion.head_kernels import turn_between, turned_by, usual_errors

DT = 1.0 / 60.0
CENTRES = np.array([[0.0, -2.5, 1.4], [-2.0, -1.5, 1.5], [2.0, -1.5, 1.8]])
PLACE = np.array([0.1, 0.2, 1.6])
STRAIGHT = Rotation.from_euler("z", 0.4).as_matrix()


def turn(yaw_deg: float, pitch_deg: float = 0.0, roll_deg: float = 0.0) -> np.ndarray:
    return Rotation.from_euler("ZXY", [yaw_deg, -pitch_deg, roll_deg], degrees=True).as_matrix()


def rays(head: np.ndarray, *, size: float = 1.0, shift: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Points on the rays of a face that is turned from straight, shape (3, 11, 3)."""
    points = PLACE + np.array(shift) + size * PLACES_M @ (STRAIGHT @ head).T
    away = points - CENTRES[:, None]
    return CENTRES[:, None] + away / np.linalg.norm(away, axis=-1, keepdims=True)


def off_deg(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.linalg.norm(turn_between(a, b))))


def followed(seen: list[np.ndarray | None], cameras: int = 3) -> list[HeadStep | None]:
    follower = HeadFollower()
    return [
        follower.follow(STRAIGHT, PLACE, None if one is None else one[:cameras], CENTRES[:cameras], DT)
        for one in seen
    ]


def found(seen: list[np.ndarray | None], cameras: int = 3) -> np.ndarray:
    step = followed(seen, cameras)[-1]
    assert step is not None
    return step.state.turn


def test_the_face_is_that_of_the_joint_set() -> None:
    assert len(NAMES) == LANDMARKS == len(PLACES_M) and NAMES[0] == "nose"
    assert [NAMES[k] for k in EARS] == ["left_ear", "right_ear"]
    assert np.allclose(PLACES_M[MIRROR], PLACES_M * [-1.0, 1.0, 1.0])
    assert all(x > 0.0 for name, (x, _, _) in zip(NAMES, PLACES_M, strict=True) if "left" in name)


@pytest.mark.parametrize("vector", [(0.3, -0.2, 0.9), (0.0, 0.0, 0.0), (1e-7, 0.0, 0.0), (0.0, 2.5, 0.0)])
def test_turns_and_their_vectors(vector: tuple[float, float, float]) -> None:
    rotation = turned_by(np.array(vector), STRAIGHT)
    assert np.allclose(rotation, Rotation.from_rotvec(vector).as_matrix() @ STRAIGHT, atol=1e-12)
    assert np.allclose(turn_between(rotation, STRAIGHT), vector, atol=1e-9)


@pytest.mark.parametrize("cameras", [1, 2, 3])
@pytest.mark.parametrize(
    "wanted", [(0.0, 0.0, 0.0), (45.0, 0.0, 0.0), (-30.0, 20.0, 0.0), (10.0, -15.0, 15.0)]
)
def test_yaw_pitch_and_roll_are_found(cameras: int, wanted: tuple[float, float, float]) -> None:
    head = turn(*wanted)
    assert off_deg(found([rays(head)] * 60, cameras), head) < 3.0


def test_a_small_face_beside_the_bodys_head_is_found_as_well() -> None:
    head = turn(30.0, -10.0)
    assert off_deg(found([rays(head, size=0.7, shift=(0.02, -0.02, 0.03))] * 60), head) < 3.0


def test_a_camera_that_exchanges_left_and_right_or_sees_another_face_does_not_matter() -> None:
    head, other = turn(25.0, 5.0), turn(-60.0)
    seen = rays(head)
    seen[0] = seen[0, MIRROR]
    assert off_deg(found([seen] * 30), head) < 3.0
    seen[0] = rays(other, shift=(0.6, 0.0, 0.0))[0]
    assert off_deg(found([seen] * 30), head) < 3.0


def test_a_head_that_nobody_sees_returns_to_straight_and_is_then_left_alone() -> None:
    steps = followed([rays(turn(40.0))] * 30 + [None] * round((FORGET_S + 0.1) / DT))
    angles = [None if step is None else off_deg(step.state.turn, np.eye(3)) for step in steps]
    assert angles[29] == pytest.approx(40.0, abs=2.0)
    late = angles[29 + round(2.5 / DT)]
    assert late is not None and late < 5.0
    assert angles[-1] is None


def test_nothing_is_followed_before_a_face_is_seen() -> None:
    assert followed([None, np.full((3, LANDMARKS, 3), np.nan)]) == [None, None]


def test_from_behind_only_ears_count() -> None:
    errors = usual_errors(np.eye(3), np.zeros(3), np.array([0.0, 2.5, 0.0]), PLACES_M, np.array(EARS))
    assert (errors[EARS] == 1.0).all() and (np.delete(errors, EARS) > 3.0).all()
    ahead = usual_errors(np.eye(3), np.zeros(3), np.array([0.0, -2.5, 0.0]), PLACES_M, np.array(EARS))
    assert (ahead == 1.0).all()


def test_smoothing_bridges_a_gap_and_does_not_lag() -> None:
    course = [turn(60.0 * np.sin(0.05 * k)) for k in range(90)]
    seen = [None if 40 <= k < 50 else rays(head) for k, head in enumerate(course)]
    steps = [step for step in followed(seen) if step is not None]
    assert len(steps) == 90
    errors = [off_deg(state.turn, head) for state, head in zip(smoothed(steps), course, strict=True)]
    live = [off_deg(step.state.turn, head) for step, head in zip(steps, course, strict=True)]
    assert max(errors[5:-5]) < 4.0 and max(errors[40:50]) < 0.8 * max(live[40:50])

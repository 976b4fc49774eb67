import numpy as np
import pytest

from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.kinematics import SiteKinematics
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.solve.kalman.feet import FEET, LEAST_HEIGHT, StandingFeet
from tests.engine.torture import PERFORMER

HUMANOID = build_humanoid(Skeleton.of(PERFORMER))
NV, DT = HUMANOID.model.nv, 1 / 60
PLACE = 0.02**2 * np.eye(NV)
KINEMATICS = SiteKinematics(HUMANOID)


def feet_of(q):
    return KINEMATICS.place(q)[FEET].copy()


@pytest.fixture
def feet():
    return StandingFeet(HUMANOID, *HUMANOID.range_rad.T)


def moved(metres, axis=0):
    q = HUMANOID.rest_qpos.copy()
    q[axis] += metres
    return q


def run(feet, path, axis=0):
    """The output feet while the hips move along a path [m], one value per frame."""
    out, last = [], path[0]
    for metres in path:
        velocity = np.zeros(NV)
        velocity[axis], last = (metres - last) / DT, metres
        out.append(feet_of(feet.held(moved(metres, axis), velocity, PLACE, DT)))
    return np.array(out)


def test_standing_feet_stay_where_they_stand_while_the_body_sways(feet):
    sway = 0.02 * np.sin(np.arange(120) * DT * 2 * np.pi)
    put_out = run(feet, sway)[12:]
    speed = np.linalg.norm(np.diff(put_out, axis=0), axis=2) / DT
    assert speed.mean() < 0.03 < np.abs(np.diff(sway)).mean() / DT


def test_feet_that_move_on_are_let_go(feet):
    path = np.concatenate([np.zeros(30), np.arange(60) * DT * 0.5])
    put_out = run(feet, path)
    np.testing.assert_allclose(put_out[-1], feet_of(moved(path[-1])), atol=0.075)


def test_feet_that_jump_are_let_go_at_once(feet):
    path = np.concatenate([np.zeros(30), np.arange(12) * DT * 2.0])
    put_out = run(feet, path, axis=2)
    np.testing.assert_allclose(put_out[-1], feet_of(moved(path[-1], axis=2)), atol=0.01)


def test_feet_stay_above_the_floor(feet):
    rest = feet_of(HUMANOID.rest_qpos)[:, 2]
    sunk = run(feet, np.concatenate([np.zeros(30), np.full(30, -0.06)]), axis=2)
    assert (sunk[-1, :, 2] > LEAST_HEIGHT * rest + feet.floor_m - 0.01).all()


def test_a_body_that_is_first_shown_deep_under_the_floor_does_not_lower_it(feet):
    put_out = run(feet, np.concatenate([np.full(20, -1.1), np.zeros(30)]), axis=2)
    assert feet.floor_m > -0.02
    np.testing.assert_allclose(put_out[-1], feet_of(HUMANOID.rest_qpos), atol=0.02)


def test_what_is_sure_does_not_give_way(feet):
    place = PLACE.copy()
    place[:6, :6] *= 1e-4
    run(feet, np.zeros(20))
    q = moved(0.02)
    out = feet.held(q, np.zeros(NV), place, DT)
    assert np.abs(out[:3] - q[:3]).max() < 0.001


def test_a_foot_that_points_through_the_floor_is_lifted_whole(feet):
    """Its ankle is as low as a standing one; were it held there, toes that surely point down would stay under."""
    q, place = HUMANOID.rest_qpos.copy(), PLACE.copy()
    bend = HUMANOID.model.joint("RightFoot_bend")
    q[bend.qposadr[0]], place[bend.dofadr[0], bend.dofadr[0]] = np.radians(50), 0.001**2
    for _ in range(20):
        out = feet.held(q, np.zeros(NV), place, DT)
    least = LEAST_HEIGHT * feet_of(HUMANOID.rest_qpos)[:, 2] + feet.floor_m
    assert (feet_of(out)[:, 2] > least - 0.005).all()


def test_a_foot_that_stands_by_an_edit_comes_to_the_mean_of_where_it_was_seen(feet):
    rng, stands = np.random.default_rng(0), np.ones(4, dtype=np.int8)
    sway = 0.02 * rng.standard_normal(480)
    sway[0] = 0.05  # it was first seen far off
    out = []
    for metres in sway:
        out.append(feet_of(feet.held(moved(metres), np.zeros(NV), PLACE, DT, stands))[:, 0])
    off = np.abs(np.array(out) - feet_of(HUMANOID.rest_qpos)[:, 0])
    assert off[0].min() > 0.03 and off[-1].max() < 0.008
    late = np.diff(np.array(out)[240:], axis=0) / DT
    assert np.abs(late).mean() < 0.03

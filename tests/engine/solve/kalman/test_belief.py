import mujoco
import numpy as np
import pytest

from studio.engine.model.human.humanoid import FREE_DOFS, build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.solve.kalman.belief import (
    LIVELY_RANGE,
    REST_PER_S,
    VELOCITY_MEMORY_S,
    Belief,
    acceleration_density,
)
from tests.engine.torture import PERFORMER

HUMANOID = build_humanoid(Skeleton.of(PERFORMER))
NV = HUMANOID.model.nv
DENSITY = acceleration_density(np.ones(NV))


@pytest.fixture
def belief():
    belief = Belief(HUMANOID, DENSITY, *HUMANOID.range_rad.T)
    q = HUMANOID.rest_qpos.copy()
    for leg in ("Left", "Right"):  # bent, so that every twist has its usual freedom
        q[HUMANOID.model.joint(f"{leg}Leg_bend").qposadr[0]] = 1.0
        q[HUMANOID.model.joint(f"{leg}ForeArm_bend").qposadr[0]] = -1.0
    belief.begin(q)
    return belief


def test_every_degree_of_freedom_accelerates_and_one_that_resists_does_less():
    assert (DENSITY > 0).all()
    np.testing.assert_allclose(acceleration_density(np.full(NV, 0.5)), DENSITY / 4.0)


def test_covariance_moves_on_as_the_motion_prior_says(belief):
    dt, rng = 0.02, np.random.default_rng(1)
    half = rng.normal(size=(2 * NV, 2 * NV)) * 0.002
    before = half @ half.T
    belief.covariance[:] = before
    belief.predict(dt)

    keep = np.exp(-dt / VELOCITY_MEMORY_S)
    move = np.eye(2 * NV)
    move[:NV, NV:] = dt * np.eye(NV)
    move[NV:, NV:] *= keep
    noise = np.block(
        [
            [np.diag(DENSITY * dt**3 / 3), np.diag(DENSITY * dt**2 / 2)],
            [np.diag(DENSITY * dt**2 / 2), np.diag(DENSITY * dt)],
        ]
    )
    expected = move @ before @ move.T + noise
    # the weak pull to rest can only reduce the hinges' variance, and hardly does here
    np.testing.assert_allclose(belief.covariance, expected, rtol=0.02, atol=1e-6)
    np.testing.assert_allclose(belief.covariance, belief.covariance.T, atol=1e-12)


def test_velocity_carries_the_body_on_and_fades(belief):
    start = belief.q.copy()
    belief.velocity[0] = 1.0
    belief.predict(0.1)
    assert belief.q[0] - start[0] == pytest.approx(0.1)
    assert belief.velocity[0] == pytest.approx(np.exp(-0.1 / VELOCITY_MEMORY_S))


def test_no_hinge_is_carried_out_of_its_range(belief):
    belief.velocity[FREE_DOFS:] = 100.0
    belief.predict(0.2)
    low, high = HUMANOID.range_rad.T
    assert (belief.q[7:] <= high).all() and (belief.q[7:] >= low).all()
    assert (belief.velocity[FREE_DOFS:] <= 100.0).all()


def test_what_nothing_shows_goes_to_rest(belief):
    for _ in range(1200):
        belief.predict(1 / 60)
    assert np.abs(belief.q[7:] - HUMANOID.rest_q).max() < 0.1
    assert (np.linalg.eigvalsh(belief.covariance) > 0).all()
    assert REST_PER_S > 0


def test_covariance_with_a_later_configuration(belief):
    rng = np.random.default_rng(2)
    half = rng.normal(size=(2 * NV, 2 * NV)) * 0.1
    belief.covariance[:] = half @ half.T
    late_s = 0.03
    with_later, added = belief.toward(late_s)
    move = np.hstack([np.eye(NV), late_s * np.eye(NV)])
    np.testing.assert_allclose(with_later, belief.covariance @ move.T)
    np.testing.assert_allclose(added, DENSITY * late_s**3 / 3)


def test_a_step_moves_configuration_and_velocity(belief):
    step, back = np.zeros(2 * NV), np.zeros(NV)
    step[2], step[NV + 2] = 0.1, 0.5
    before = belief.q.copy()
    belief.correct(step, np.zeros(2 * NV), np.zeros((2 * NV, 2 * NV)))
    mujoco.mj_differentiatePos(HUMANOID.model, back, 1.0, before, belief.q)
    assert back[2] == pytest.approx(0.1) and belief.velocity[2] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("deviations", "share"), [(0.0, LIVELY_RANGE[0]), (1.0, 1.0), (4.0, LIVELY_RANGE[1])]
)
def test_what_is_corrected_by_more_than_expected_accelerates_more(belief, deviations, share):
    """A velocity with a correction of the expected size accelerates as usual."""
    dof, gained, step = 2, np.zeros((2 * NV, 2 * NV)), np.zeros(2 * NV)
    gained[NV + dof, NV + dof], step[NV + dof] = 1e-4, deviations * 1e-2
    for _ in range(200):
        belief.predict(1 / 60)
        belief.correct(step, np.zeros(2 * NV), gained)
    before = belief.toward(0.03)[1][dof]
    assert before == pytest.approx(share * DENSITY[dof] * 0.03**3 / 3, rel=0.02)
    belief.begin(belief.q)
    belief.predict(1 / 60)
    assert belief.toward(0.03)[1][dof] == pytest.approx(DENSITY[dof] * 0.03**3 / 3)


def test_what_is_told_later_corrects_what_was_before(belief):
    """Compared with the gain of Rauch, Tung and Striebel, for hips, whose place no rest pulls."""
    rng, dt, hips = np.random.default_rng(3), 1 / 60, np.r_[0:3, NV : NV + 3]
    half = np.zeros((2 * NV, 2 * NV))
    half[np.ix_(hips, hips)] = 0.1 * rng.normal(size=(6, 6))
    belief.covariance[:] += half @ half.T
    before, velocity, covariance = belief.q.copy(), belief.velocity.copy(), belief.covariance.copy()
    belief.predict(dt)
    told, back = np.zeros(2 * NV), np.zeros(NV)
    told[:3] = 1.0
    step = belief.covariance @ told
    belief.correct(step, told, np.zeros((2 * NV, 2 * NV)))
    keep = np.exp(-dt / VELOCITY_MEMORY_S)
    move = np.block([[np.eye(3), dt * np.eye(3)], [np.zeros((3, 3)), keep * np.eye(3)]])
    small = np.ix_(hips, hips)
    gain = covariance[small] @ move.T @ np.linalg.inv(belief.covariance[small])
    q, earlier_velocity, _ = belief.earlier()
    mujoco.mj_differentiatePos(HUMANOID.model, back, 1.0, before, q)
    expected = gain @ step[hips]
    np.testing.assert_allclose(back[:3], expected[:3], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose((earlier_velocity - velocity)[:3], expected[3:], rtol=1e-6, atol=1e-9)


def test_hinges_that_are_put_elsewhere_were_there_before(belief):
    belief.predict(1 / 60)
    q, told = belief.q.copy(), np.zeros(2 * NV)
    q[10] += 0.2
    belief.put(q, np.array([3]))
    told[FREE_DOFS + 3] = 50.0
    belief.correct(np.zeros(2 * NV), told, np.zeros((2 * NV, 2 * NV)))
    assert belief.earlier()[0][10] == q[10]

"""What the solve minimises: derivatives against finite differences, bounds of steps."""

import mink
import mujoco
import numpy as np
import pytest

from studio.engine.model.joints import JOINT_COUNT
from studio.engine.solve.ik.tasks import MAX_ERROR_M, HingeLimit, JointPositionsTask, MotionPriorTask
from tests.engine.walkers import humanoid, random_q, site_positions


@pytest.fixture
def configuration():
    return mink.Configuration(humanoid().model, random_q(humanoid(), np.random.default_rng(1)))


def test_the_jacobian_is_that_of_finite_differences(configuration):
    body, task = humanoid(), JointPositionsTask(humanoid())
    q = configuration.q.copy()
    task.set_targets(site_positions(body, q) + 0.01, np.ones(JOINT_COUNT))
    jacobian, error = task.compute_jacobian(configuration).copy(), task.compute_error(configuration)
    for column in range(body.model.nv):
        moved, step = q.copy(), np.zeros(body.model.nv)
        step[column] = 1e-6
        mujoco.mj_integratePos(body.model, moved, step, 1.0)
        difference = (task.compute_error(mink.Configuration(body.model, moved)) - error) / 1e-6
        assert jacobian[:, column] == pytest.approx(difference, abs=1e-4)


def test_a_joint_of_no_weight_takes_no_part(configuration):
    task, targets = JointPositionsTask(humanoid()), np.full((JOINT_COUNT, 3), np.nan)
    task.set_targets(targets, np.zeros(JOINT_COUNT))
    objective = task.compute_qp_objective(configuration)
    assert np.isfinite(objective.H).all() and np.abs(objective.H).max() == 0 == np.abs(objective.c).max()


def test_far_targets_pull_no_harder_than_near_ones(configuration):
    task = JointPositionsTask(humanoid())
    task.set_targets(np.full((JOINT_COUNT, 3), 1e30), np.ones(JOINT_COUNT))
    lengths = np.linalg.norm(task.compute_error(configuration).reshape(-1, 3), axis=1)
    assert lengths == pytest.approx(MAX_ERROR_M)


def test_the_prior_is_least_where_it_predicts(configuration):
    prior = MotionPriorTask(humanoid())
    prior.stiffness[:] = 2.0
    prior.predicted = random_q(humanoid(), np.random.default_rng(2))
    objective = prior.compute_qp_objective(configuration)
    step = np.linalg.solve(objective.H, -objective.c)
    reached = configuration.q.copy()
    mujoco.mj_integratePos(humanoid().model, reached, step, 1.0)
    assert reached[7:] == pytest.approx(prior.predicted[7:])
    assert reached[:3] == pytest.approx(prior.predicted[:3])


def test_steps_are_bounded_by_the_ends_and_the_longest_step(configuration):
    body = humanoid()
    low, high = body.range_rad.T
    limit = HingeLimit(body, 0.3).compute_qp_inequalities(configuration, 1.0)
    hinges = len(low)
    assert (limit.h >= 0).all() and (limit.h <= 0.3).all()
    q = configuration.q[7:]
    assert limit.h[:hinges] == pytest.approx(np.minimum(high - q, 0.3))
    assert limit.h[hinges:] == pytest.approx(np.minimum(q - low, 0.3))
    free = HingeLimit(body, 0.3, limited=False).compute_qp_inequalities(configuration, 1.0)
    assert free.h == pytest.approx(0.3)
    assert (limit.G[:, :6] == 0).all(), "the hips are free"


def test_beyond_its_end_a_hinge_may_only_come_back():
    body = humanoid()
    q = body.rest_qpos
    q[7:] = body.range_rad[:, 1] + 0.1
    limit = HingeLimit(body, 0.3).compute_qp_inequalities(mink.Configuration(body.model, q), 1.0)
    assert (limit.h[: len(body.range_rad)] == 0).all()

"""Positions and Jacobians in one call, against MuJoCo's own and finite differences."""

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.kinematics import SiteKinematics, moving_dofs
from studio.engine.model.joints import CANONICAL
from tests.engine.walkers import humanoid, random_q, site_positions


@pytest.fixture(params=[False, True], ids=["body", "fingers"])
def body(request):
    return build_humanoid(humanoid().skeleton, fingers=request.param)


def far_away(body, seed):
    q = random_q(body, np.random.default_rng(seed))
    q[:3] += [40.0, -25.0, 3.0]
    return q


@pytest.mark.parametrize("seed", range(3))
def test_it_is_what_mujoco_says_joint_by_joint(body, seed):
    q, kinematics, data = far_away(body, seed), SiteKinematics(body), mujoco.MjData(body.model)
    positions, jacobian = kinematics.linearise(q)
    data.qpos[:] = q
    mujoco.mj_kinematics(body.model, data)
    mujoco.mj_comPos(body.model, data)
    assert (positions == data.site_xpos[body.site_ids]).all()
    for row, site in enumerate(body.site_ids):
        expected = np.zeros((3, body.model.nv))
        mujoco.mj_jacSite(body.model, data, expected, None, int(site))
        assert np.abs(jacobian[3 * row : 3 * row + 3] - expected).max() < 1e-12, CANONICAL[row]


def test_the_jacobian_is_that_of_finite_differences(body):
    q, kinematics = far_away(body, 5), SiteKinematics(body)
    positions, jacobian = (a.copy() for a in kinematics.linearise(q))
    for column in range(body.model.nv):
        moved, step = q.copy(), np.zeros(body.model.nv)
        step[column] = 1e-6
        mujoco.mj_integratePos(body.model, moved, step, 1.0)
        difference = (kinematics.place(moved) - positions).ravel() / 1e-6
        assert jacobian[:, column] == pytest.approx(difference, abs=2e-5)


def test_results_are_overwritten_and_equal_when_asked_again():
    body = humanoid()
    kinematics = SiteKinematics(body)
    first = random_q(body, np.random.default_rng(1))
    positions, jacobian = kinematics.linearise(first)
    kept = positions.copy(), jacobian.copy()
    again = kinematics.linearise(random_q(body, np.random.default_rng(2)))
    assert again[0] is positions and again[1] is jacobian
    assert not np.array_equal(positions, kept[0])
    kinematics.linearise(first)
    assert np.array_equal(positions, kept[0]) and np.array_equal(jacobian, kept[1])


def test_placing_gives_positions_alone():
    body = humanoid()
    q = random_q(body, np.random.default_rng(3))
    assert np.array_equal(SiteKinematics(body).place(q), site_positions(body, q))


def test_a_joint_is_moved_by_what_lies_between_it_and_the_hips():
    body = humanoid()
    moves = moving_dofs(body)
    names = ["Hips"] * 6 + [body.model.joint(k).name.split("_")[0] for k in range(1, body.model.njnt)]
    of_wrist = {n for n, moved in zip(names, moves[CANONICAL.index("left_wrist")], strict=True) if moved}
    assert of_wrist == {
        "Hips", "Spine", "Spine1", "Spine2", "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand",
    }  # fmt: skip
    assert moves[CANONICAL.index("hips")].sum() == 6

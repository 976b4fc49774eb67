"""The full humanoid: fingers are bodies, and coupled joints stay together in MuJoCo's simulation."""

import time

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.humanoid import COUPLINGS, FREE_DOFS, build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import CANONICAL, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL
from tests.engine.walkers import humanoid, performer, site_positions


def full(height_m=1.78, **options):
    return build_humanoid(Skeleton.of(performer(height_m)), fingers=True, **options)


def test_every_output_joint_is_a_body_and_the_bodys_hinges_are_those_of_the_solve():
    body, solved = full(), humanoid()
    assert [body.model.body(i).name for i in body.body_ids] == list(OUTPUT_JOINTS)
    assert list(body.body_outputs) == list(range(len(OUTPUT_JOINTS)))
    assert (solved.model.nv, body.model.nv) == (55, 55 + 2 * 20) and solved.model.neq == 0
    names = {body.model.joint(i).name: body.range_rad[i - 1] for i in range(1, body.model.njnt)}
    for i in range(1, solved.model.njnt):
        assert names[solved.model.joint(i).name] == pytest.approx(solved.range_rad[i - 1])


@pytest.mark.parametrize("height_m", [0.9, 1.78, 2.3])
def test_the_t_pose_is_the_skeletons(height_m):
    body = full(height_m)
    data = mujoco.MjData(body.model)
    data.qpos[:] = body.rest_qpos
    data.qpos[7:] = 0.0
    mujoco.mj_kinematics(body.model, data)
    assert np.abs(data.xpos[body.body_ids] - body.skeleton.rest_positions_m).max() < 1e-12
    assert np.abs(data.xmat[body.body_ids].reshape(-1, 3, 3) - np.eye(3)).max() < 1e-12


def test_canonical_joints_are_where_the_solve_has_them_and_the_knuckle_is_the_fingers_own_body():
    body, solved = full(), humanoid()
    for side in ("left", "right"):
        at = body.model.site(f"{side}_hand").bodyid[0]
        assert body.model.body(at).name == OUTPUT_OF_CANONICAL[f"{side}_hand"]
    assert [body.model.site(i).name for i in body.site_ids] == list(CANONICAL)
    assert site_positions(body, body.rest_qpos) == pytest.approx(site_positions(solved, solved.rest_qpos))


def test_it_builds_in_milliseconds():
    skeleton = Skeleton.of(performer())
    times = []
    for _ in range(5):
        start = time.thread_time()
        build_humanoid(skeleton, fingers=True)
        times.append(time.thread_time() - start)
    assert min(times) < 0.03  # 6 ms on an idle core


def test_couplings_name_hinges_whose_ranges_allow_them():
    body = full()
    place = {body.model.joint(i).name: i - 1 for i in range(1, body.model.njnt)}
    assert body.model.neq == len(COUPLINGS) == 6 + 8
    for follower, (leader, share) in COUPLINGS.items():
        low, high = body.range_rad[place[leader]] * share
        assert body.range_rad[place[follower]][0] <= low + 1e-9, follower
        assert body.range_rad[place[follower]][1] >= high - 1e-9, follower


@pytest.mark.parametrize("height_m", [0.9, 1.78, 2.3])
def test_couplings_hold_in_simulation(height_m):
    """Muscles pull at the leading joints for a second, against the joints' damping."""
    body = full(height_m)
    model, size = body.model, (height_m / 1.78) ** 4
    model.opt.timestep, model.opt.gravity[:] = 0.002, 0.0
    fingers = np.array(["Hand" in model.joint(model.dof_jntid[k]).name for k in range(model.nv)])
    model.dof_damping[FREE_DOFS:] = np.where(fingers, 0.002, 1.0)[FREE_DOFS:] * size
    pairs = [(model.joint(a), model.joint(b), share) for a, (b, share) in COUPLINGS.items()]
    followers, leaders = (np.array([pair[k].qposadr[0] for pair in pairs]) for k in (0, 1))
    shares = np.array([share for *_, share in pairs])
    pulled = np.array([leader.dofadr[0] for _, leader, _ in pairs])
    data = mujoco.MjData(model)
    data.qpos[:] = body.rest_qpos
    worst, moved = 0.0, np.zeros(len(pairs))
    for k in range(500):
        torque = np.where(fingers, 0.006, 6.0) * size * np.sin(6.0 * k * model.opt.timestep)
        data.qfrc_applied[pulled] = torque[pulled]
        mujoco.mj_step(model, data)
        moved = np.maximum(moved, np.abs(data.qpos[leaders]))
        if k > 150:
            worst = max(worst, np.abs(data.qpos[followers] - shares * data.qpos[leaders]).max())
    assert np.isfinite(data.qpos).all() and (moved > np.radians(3)).all()
    assert worst < np.radians(0.5)

"""A single limb is where MuJoCo puts it, and finds its joints again within its ranges."""

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.chain import solve_in_place
from studio.engine.model.joints import INDEX
from studio.engine.solve.ik.limb_chain import REST_M, LimbChain
from tests.engine.walkers import humanoid, site_positions

ARM = ("RightShoulder", "RightArm", "RightForeArm", "RightHand"), ("right_elbow", "right_wrist", "right_hand")
LEG = ("LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase"), ("left_knee", "left_ankle", "left_toe")
SHARE = np.array([1.0, 0.8, 0.5])


def limb_of(body, bodies, names):
    joints = np.array([INDEX[name] for name in names])
    return LimbChain(body, bodies, joints, body.range_rad.T), joints


def anywhere(body, rng):
    q = body.rest_qpos
    q[:3], q[3:7] = rng.normal(size=3), rng.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] = rng.uniform(*body.range_rad.T)
    return q


def data_at(body, q):
    data = mujoco.MjData(body.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(body.model, data)
    return data


@pytest.mark.parametrize("limb", [ARM, LEG])
def test_it_is_where_mujoco_puts_it(limb):
    body, rng = humanoid(), np.random.default_rng(3)
    chain, joints = limb_of(body, *limb)
    free = np.zeros(len(chain.hinges), dtype=bool)
    for _ in range(10):
        q, targets = anywhere(body, rng), rng.normal(size=(3, 3))
        now = q[7 + chain.hinges]
        found = chain.tried(data_at(body, q), now, [now, chain.rest], free, targets, SHARE)
        off = SHARE[:, None] * (site_positions(body, q)[joints] - targets)
        stray = REST_M * (now - chain.rest) / body.spread_rad[chain.hinges]
        assert found.now == pytest.approx((off**2).sum() + stray @ stray, abs=1e-12)
        for left, hinges in zip(found.left, found.hinges, strict=True):
            there = q.copy()
            there[7 + chain.hinges] = hinges
            again = chain.tried(data_at(body, there), hinges, [hinges], free, targets, SHARE)
            assert left == pytest.approx(again.now, abs=1e-12)
            assert (hinges >= chain.ranges[0]).all() and (hinges <= chain.ranges[1]).all()


@pytest.mark.parametrize("limb", [ARM, LEG])
def test_it_finds_joints_that_it_can_reach(limb):
    body, rng = humanoid(), np.random.default_rng(5)
    chain, joints = limb_of(body, *limb)
    free = np.zeros(len(chain.hinges), dtype=bool)
    for _ in range(10):
        q = anywhere(body, rng)
        targets, now = site_positions(body, q)[joints], q[7 + chain.hinges]
        near = np.clip(now + rng.normal(0.0, 0.1, len(now)), *chain.ranges)
        q[7 + chain.hinges] = near
        found = chain.tried(data_at(body, q), near, [near], free, targets, SHARE)
        q[7 + chain.hinges] = found.hinges[0]
        off = np.linalg.norm(site_positions(body, q)[joints] - targets, axis=1)
        assert found.left[0] < found.now and off.max() < 0.05, "the pull to rest leaves a little"


def test_hinges_that_are_held_stay():
    body = humanoid()
    chain, joints = limb_of(body, *ARM)
    held = np.arange(len(chain.hinges)) < 3
    q = body.rest_qpos
    now, targets = q[7 + chain.hinges], site_positions(body, q)[joints] + 0.1
    found = chain.tried(data_at(body, q), now, [now, now + 0.3], held, targets, SHARE)
    assert (found.hinges[:, held] == now[held]).all() and (found.hinges[:, ~held] != now[~held]).any()


def test_equations_are_solved():
    rng = np.random.default_rng(2)
    A, g = rng.normal(size=(9, 9)), rng.normal(size=9)
    H = A @ A.T + 0.1 * np.eye(9)
    wanted, x = np.linalg.solve(H, g), g.copy()
    solve_in_place(H, x)
    assert x == pytest.approx(wanted)

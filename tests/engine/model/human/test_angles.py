"""Hinge angles of a pose, as the inverse of forward kinematics."""

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.angles import configuration_of
from studio.engine.model.joints import OUTPUT_JOINTS
from tests.engine.walkers import humanoid, random_q


def rotations_of(body, q):
    data = mujoco.MjData(body.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(body.model, data)
    rotations = np.tile(np.eye(3), (len(OUTPUT_JOINTS), 1, 1))
    rotations[body.body_outputs] = data.xmat[body.body_ids].reshape(-1, 3, 3)
    return rotations


@pytest.mark.parametrize("limited", [True, False])
def test_it_inverts_forward_kinematics_within_the_ranges(limited):
    body, rng = humanoid(), np.random.default_rng(11)
    worst = np.zeros(len(body.range_rad))
    for _ in range(300):
        q = random_q(body, rng, reach=0.98)
        found = configuration_of(body, q[:3], rotations_of(body, q), limited=limited)
        worst = np.maximum(worst, np.abs(found[7:] - q[7:]))
        assert np.allclose(found[:3], q[:3])
        assert abs(found[3:7] @ q[3:7]) == pytest.approx(1.0)
    names = [body.model.joint(i + 1).name for i in range(len(worst))]
    assert worst.max() < 1e-6, {
        n: f"{np.degrees(w):.3g} deg" for n, w in zip(names, worst, strict=True) if w > 1e-6
    }


def test_the_t_pose_is_all_zeros():
    body = humanoid()
    q = body.rest_qpos
    q[7:] = 0.0
    assert np.abs(configuration_of(body, q[:3], rotations_of(body, q))[7:]).max() < 1e-9


def test_limited_angles_are_within_the_ranges_whatever_the_rotations():
    body, rng = humanoid(), np.random.default_rng(12)
    low, high = body.range_rad.T
    for _ in range(50):
        q = random_q(body, rng)
        q[7:] = rng.uniform(-np.pi, np.pi, len(low))
        found = configuration_of(body, q[:3], rotations_of(body, q))
        assert (found[7:] >= low).all() and (found[7:] <= high).all()

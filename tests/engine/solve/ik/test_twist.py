"""Joints do not define the twist of a straight limb, so it stays."""

import numpy as np
import pytest

from studio.engine.model.joints import CANONICAL, JOINT_COUNT
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.ik.solver import Solver
from studio.engine.solve.ik.twist import LEAST_SHARE, LimbTwists
from tests.engine.walkers import humanoid, site_positions

DT = 1 / 60


def with_hinges(body, **degrees):
    q = body.rest_qpos
    for name, value in degrees.items():
        q[body.model.joint(name).qposadr[0]] = np.radians(value)
    return q


def test_a_limb_that_is_bent_is_free_and_a_straight_one_is_not():
    body, twists = humanoid(), LimbTwists(humanoid())
    bent = with_hinges(body, LeftForeArm_bend=-60, RightForeArm_bend=60, LeftLeg_bend=60, RightLeg_bend=60)
    assert twists.freedom(bent) == pytest.approx(1.0)
    straight = with_hinges(body, LeftForeArm_bend=0, RightForeArm_bend=60, LeftLeg_bend=0, RightLeg_bend=60)
    assert twists.freedom(straight) == pytest.approx([LEAST_SHARE, LEAST_SHARE, 1.0, 1.0])


def test_its_twists_are_those_of_upper_arms_and_thighs():
    body = humanoid()
    names = [body.model.joint(int(body.model.dof_jntid[dof])).name for dof in LimbTwists(body).dofs]
    assert names == ["LeftArm_twist", "LeftUpLeg_twist", "RightArm_twist", "RightUpLeg_twist"]


def test_noise_does_not_twist_a_straight_arm():
    """The elbow's noise, a little off the arm's line, would turn it."""
    body, rng = humanoid(), np.random.default_rng(3)
    solver = Solver(body, parse_settings("studio"))
    at = body.model.joint("LeftArm_twist").qposadr[0]
    joints = site_positions(body, with_hinges(body, LeftForeArm_bend=0, LeftForeArm_twist=0))
    twist = []
    for _ in range(240):
        seen = joints + rng.normal(0, 0.015, (JOINT_COUNT, 3)) * [[n.startswith("left")] for n in CANONICAL]
        twist.append(np.degrees(solver.solve(seen, np.full(JOINT_COUNT, 0.015), DT)[at]))
    turns = np.abs(np.diff(twist[30:]))
    assert turns.max() < 12.0
    assert turns.mean() < 3.0

"""Reach, pull and resist behave as users of HumanIK expect."""

import numpy as np
import pytest

from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT
from studio.engine.model.settings.settings import SolveSettings, parse_settings
from studio.engine.solve.ik.effectors import HELD, pull_scale, resist_scale
from studio.engine.solve.ik.solver import Solver
from tests.engine.walkers import humanoid, site_positions

DT = 1 / 60
SIGMA = np.full(JOINT_COUNT, 0.01)
MODES = ("previous_pose", "combined_skeleton")
ARM = ("elbow", "wrist", "hand")


def rest():
    return site_positions(humanoid(), humanoid().rest_qpos)


def arm_pulled(by=(0.1, -0.9, 0.9)):
    """The left hand and wrist pulled forward and up, far beyond the arm's reach."""
    joints = rest()
    joints[[INDEX["left_wrist"], INDEX["left_hand"]]] += by
    joints[INDEX["left_elbow"]] += [0.05, -0.25, 0.2]
    return joints


def followed(joints, mode, *assignments, frames=60):
    """Configuration and joints after following new joints for a second, from rest."""
    solver = Solver(humanoid(), parse_settings("studio", (f"ik={mode}", *assignments)))
    for k in range(20 + frames):
        q = solver.solve(rest() if k < 20 else joints, SIGMA, DT)
    return q, site_positions(humanoid(), q)


def each(name, value, joints):
    return tuple(f"effectors.{joint}.{name}={value}" for joint in joints)


def moved_m(joints, *names):
    return float(np.linalg.norm((joints - rest())[[INDEX[name] for name in names]], axis=1).mean())


@pytest.mark.parametrize("mode", MODES)
def test_a_joint_of_no_reach_is_not_followed(mode):
    raised = arm_pulled()
    _, with_reach = followed(raised, mode)
    _, without = followed(raised, mode, *each("reach", 0, [f"left_{joint}" for joint in ARM]))
    assert moved_m(with_reach, "left_wrist") > 0.4
    assert moved_m(without, "left_wrist") < 0.06
    assert moved_m(without, "hips", "chest", "right_wrist") < 0.01


@pytest.mark.parametrize("mode", MODES)
def test_less_reach_follows_less(mode):
    """The chest and the pulled wrist contradict each other: reach decides between them."""
    joints = arm_pulled(by=(0.1, -0.6, 0.6))
    left = [
        float(np.linalg.norm((followed(joints, mode, *each("reach", reach, [f"left_{j}" for j in ARM]))[1] - joints)[
            INDEX["left_wrist"]
        ]))
        for reach in (0.05, 0.3, 1.0)
    ]  # fmt: skip
    assert left[0] > left[1] + 0.01 and left[1] > left[2] + 0.01


@pytest.mark.parametrize("mode", MODES)
def test_a_hand_without_pull_does_not_drag_the_trunk(mode):
    _, dragged = followed(arm_pulled(), mode)
    _, let_be = followed(arm_pulled(), mode, *each("pull", 0, [f"left_{joint}" for joint in ARM]))
    trunk = ("hips", "chest", "neck", "head", "left_shoulder", "right_shoulder")
    assert moved_m(dragged, *trunk) > 0.03
    assert moved_m(let_be, *trunk) < 0.2 * moved_m(dragged, *trunk)
    assert moved_m(let_be, "left_wrist") > 0.3, "the arm itself follows"


def test_a_joint_that_resists_keeps_its_pose():
    body = humanoid()
    hinges = [7 + body.model.joint(f"LeftForeArm_{name}").id - 1 for name in ("bend", "twist")]
    free, _ = followed(arm_pulled(), "previous_pose")
    resists = each("resist", 1, ["left_elbow"])
    began, _ = followed(arm_pulled(), "previous_pose", *resists, frames=0)
    held, joints = followed(arm_pulled(), "previous_pose", *resists)
    half, _ = followed(arm_pulled(), "previous_pose", *each("resist", 0.9, ["left_elbow"]), frames=5)
    soon, _ = followed(arm_pulled(), "previous_pose", frames=5)
    assert np.abs(free - body.rest_qpos)[hinges].max() > np.radians(8)
    assert np.abs(held - began)[hinges].max() < np.radians(1)
    assert moved_m(joints, "left_wrist") > 0.2, "the shoulder goes on"
    assert np.abs(half - soon)[hinges].max() > np.radians(1)


def test_hips_that_resist_do_not_turn_but_go_along():
    walked = rest() + np.array([0.2, 0.1, 0.0])
    tilted = walked.copy()
    tilted[[INDEX["neck"], INDEX["head"], INDEX["left_shoulder"], INDEX["right_shoulder"]]] += [
        0.25,
        0,
        -0.05,
    ]
    q, joints = followed(tilted, "previous_pose", *each("resist", 1, ["hips"]))
    free, _ = followed(tilted, "previous_pose")
    assert np.abs(q[3:7] - [1, 0, 0, 0]).max() < 0.01 < 0.03 < np.abs(free[3:7] - [1, 0, 0, 0]).max()
    assert moved_m(joints, "hips") > 0.15


def test_knees_and_elbows_have_less_influence_than_what_they_carry():
    effectors = SolveSettings().effectors
    for side in ("left", "right"):
        assert effectors[f"{side}_elbow"].reach < effectors[f"{side}_wrist"].reach
        assert effectors[f"{side}_knee"].reach < effectors[f"{side}_ankle"].reach


def test_the_scales_are_of_the_joints_that_they_name():
    body = humanoid()
    names = ["Hips"] * 6 + [body.model.joint(k).name.split("_")[0] for k in range(1, body.model.njnt)]
    assert pull_scale(body, SolveSettings().effectors) is None
    pulls = pull_scale(body, parse_settings("studio", each("pull", 0.25, ["left_wrist"])).effectors)
    changed = {names[dof] for dof in np.flatnonzero(pulls[INDEX["left_wrist"]] == 0.25)}
    assert changed == {"Hips", "Spine", "Spine1", "Spine2", "LeftShoulder", "RightShoulder"}
    assert (np.delete(pulls, INDEX["left_wrist"], axis=0) == 1).all()
    for joint in CANONICAL:
        freedom = resist_scale(body, parse_settings("studio", each("resist", 1, [joint])).effectors)
        held = {names[dof] for dof in np.flatnonzero(freedom == HELD)}
        assert len(held) <= 1 and (freedom[:3] == 1).all()

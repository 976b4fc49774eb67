"""The humanoid: it stands like its performer, mirrors itself, and its limits scale with flexibility."""

import itertools

import mujoco
import numpy as np
import pytest

from studio.engine.model.human.humanoid import BODY_JOINTS, FREE_DOFS, build_humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR, OUTPUT_INDEX, OUTPUT_JOINTS, PARENTS
from tests.engine.walkers import humanoid, performer, random_q, site_positions


def t_pose_q(body):
    q = body.rest_qpos
    q[7:] = 0.0
    return q


def mirror_q(q):
    """The configuration seen in the mirror x = 0."""
    out = q.copy()
    out[0] *= -1
    out[5:7] *= -1  # a rotation's axis keeps x and turns y and z about
    at, of = {}, 7
    for name in BODY_JOINTS[1:]:
        at[name] = slice(of, of + len(dofs_of(name)))
        of += len(dofs_of(name))
    for name, place in at.items():
        swap = {"Left": "Right", "Right": "Left"}
        other = next((swap[s] + name[len(s) :] for s in swap if name.startswith(s)), name)
        if other == name:  # about x the turn stays, about y and z it is reversed
            out[place] = q[place] * [1 if abs(dof.axis[0]) == 1 else -1 for dof in dofs_of(name)]
        else:
            out[place] = q[at[other]]
    return out


@pytest.mark.parametrize("height_m", [0.9, 1.78, 2.3])
def test_the_t_pose_has_identity_rotations_and_the_performers_offsets(height_m):
    body = humanoid(height_m)
    data = mujoco.MjData(body.model)
    data.qpos[:] = t_pose_q(body)
    mujoco.mj_kinematics(body.model, data)
    assert np.abs(data.xmat[body.body_ids].reshape(-1, 3, 3) - np.eye(3)).max() < 1e-12
    sites = data.site_xpos[body.site_ids]
    offsets = performer(height_m).offsets_m
    assert np.abs(sites[1:] - sites[PARENTS[1:]] - offsets[1:]).max() < 1e-12
    assert np.allclose(sites[INDEX["hips"]], offsets[INDEX["hips"]])
    assert sites[INDEX["left_hand"], 0] > 0.5 * height_m * 0.4
    assert sites[INDEX["left_toe"], 1] < sites[INDEX["left_ankle"], 1]


def test_bodies_carry_the_output_names_without_fingers_and_a_site_per_canonical_joint():
    body = humanoid()
    names = [body.model.body(i).name for i in body.body_ids]
    assert tuple(names) == BODY_JOINTS
    assert len(BODY_JOINTS) == len(OUTPUT_JOINTS) - 30
    assert [OUTPUT_JOINTS[i] for i in body.body_outputs] == names
    assert [body.model.site(i).name for i in body.site_ids] == list(CANONICAL)
    assert body.model.nv == FREE_DOFS + len(body.range_rad)
    assert len(body.rest_qpos) == body.model.nq


def test_the_resting_stance_is_within_the_limits_whatever_the_flexibility():
    for flexibility in (0.0, 1.0, 2.0):
        body = build_humanoid(Skeleton.of(performer()), flexibility=flexibility)
        low, high = body.range_rad.T
        assert (low <= body.rest_q).all() and (body.rest_q <= high).all()
        assert (body.spread_rad > 0).all()
    joints = site_positions(body, body.rest_qpos)
    for side in ("left", "right"):
        assert joints[INDEX[f"{side}_wrist"], 2] < joints[INDEX[f"{side}_elbow"], 2]
        assert joints[INDEX[f"{side}_wrist"], 1] < joints[INDEX[f"{side}_elbow"], 1], "elbows bend forward"
        assert joints[INDEX[f"{side}_knee"], 1] < joints[INDEX[f"{side}_ankle"], 1], "knees bend forward"


def test_more_flexibility_never_takes_range_away():
    ranges = [build_humanoid(Skeleton.of(performer()), flexibility=f).range_rad for f in (0.0, 1.0, 2.0)]
    for less, more in itertools.pairwise(ranges):
        assert (more[:, 0] <= less[:, 0] + 1e-12).all() and (more[:, 1] >= less[:, 1] - 1e-12).all()
        assert (more[:, 1] - more[:, 0]).sum() > 1.1 * (less[:, 1] - less[:, 0]).sum()


def test_without_human_limits_no_hinge_is_limited():
    hinges = slice(1, None)
    assert humanoid().model.jnt_limited[hinges].all()
    assert not humanoid(human_limits=False).model.jnt_limited[hinges].any()


def test_a_mirrored_configuration_gives_mirrored_joints_within_the_limits():
    body, rng = humanoid(), np.random.default_rng(3)
    low, high = body.range_rad.T
    for _ in range(20):
        q = random_q(body, rng)
        other = mirror_q(q)
        assert (other[7:] >= low - 1e-9).all() and (other[7:] <= high + 1e-9).all()
        seen = site_positions(body, q)[MIRROR] * [-1, 1, 1]
        assert np.abs(site_positions(body, other) - seen).max() < 1e-9


def test_knees_and_elbows_bend_only_one_way():
    body = humanoid()
    for joint, sign in (("LeftLeg", 1), ("RightLeg", 1)):
        row = body.model.joint(f"{joint}_bend").id - 1
        low, high = np.degrees(body.range_rad[row])
        assert -5 <= low <= 0 and 130 <= high * sign <= 165
    row = body.model.joint("LeftForeArm_bend").id - 1
    assert np.degrees(body.range_rad[row])[1] <= 10


def test_output_indices_of_bodies_are_in_the_output_order():
    assert (np.diff(humanoid().body_outputs) > 0).all()
    assert humanoid().body_outputs[0] == OUTPUT_INDEX["Hips"]

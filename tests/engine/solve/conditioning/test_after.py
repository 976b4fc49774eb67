"""Conditioning after the solve keeps bone lengths, ranges and speeds for any input."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.skeleton import forward_positions, local_rotations
from studio.engine.model.joints import CANONICAL, INDEX, OUTPUT_JOINTS, OUTPUT_PARENTS, PARENTS
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.conditioning.after import ConditioningAfter
from studio.engine.solve.conditioning.displacement import DEFAULT_M_S
from tests.engine.walkers import humanoid, random_q, standing

DT = 1 / 60
AFTER = ["smoothing=holt:after", "smoothing=one_euro:after", "displacement_limit=after"]
BODY = humanoid()


def after(*assignments, solved=True):
    settings = parse_settings("studio", assignments)
    return ConditioningAfter(settings, BODY.skeleton, BODY if solved else None)


def pose(q):
    """Hips [m] and world rotations, shape (52, 3, 3), of a configuration; fingers move with the hand."""
    data = mujoco.MjData(BODY.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(BODY.model, data)
    rotations = np.empty((len(OUTPUT_JOINTS), 3, 3))
    rotations[BODY.body_outputs] = data.xmat[BODY.body_ids].reshape(-1, 3, 3)
    for joint, name in enumerate(OUTPUT_JOINTS):
        if "Hand" in name and name not in ("LeftHand", "RightHand"):
            rotations[joint] = rotations[OUTPUT_PARENTS[joint]]
    return q[:3].copy(), rotations


def jumping_between_ends(count=40, seed=1):
    """Configurations with hinges at the ends of their ranges, each held for 4 frames."""
    rng = np.random.default_rng(seed)
    low, high = BODY.range_rad.T
    for _ in range(count // 4):
        q = random_q(BODY, rng)
        q[3:7], q[7:] = [1, 0, 0, 0], np.where(rng.random(len(low)) < 0.5, low, high)
        yield from [q] * 4


@pytest.mark.parametrize("assignments", [*((a,) for a in AFTER), tuple(AFTER[1:]), (AFTER[0], AFTER[2])])
def test_ranges_and_bones_are_kept_at_the_ends_of_the_ranges(assignments):
    conditioning = after(*assignments)
    low, high = BODY.range_rad.T
    lengths = np.linalg.norm(BODY.skeleton.offsets_m, axis=1)[1:]
    for q in jumping_between_ends():
        root, rotations = conditioning.apply(*pose(q), DT)
        out = configuration_of(BODY, root, rotations, limited=False)[7:]
        assert np.degrees(np.maximum(low - out, out - high).max()) < 0.05
        joints = forward_positions(BODY.skeleton, root, rotations)
        bones = np.linalg.norm(joints[1:] - joints[OUTPUT_PARENTS[1:]], axis=1)
        assert np.abs(bones - lengths).max() < 1e-9


def test_without_human_limits_nothing_is_brought_back():
    conditioning = after("smoothing=one_euro:after", "human_limits=off")
    q = BODY.rest_qpos
    q[BODY.model.joint("LeftLeg_bend").qposadr[0]] = np.radians(-30)
    for _ in range(3):
        root, rotations = conditioning.apply(*pose(q), DT)
    assert rotations == pytest.approx(pose(q)[1]) and root == pytest.approx(q[:3])


def test_a_pose_within_the_ranges_is_not_touched_by_keeping_them():
    limited, free = after("smoothing=one_euro:after"), after("smoothing=one_euro:after", "human_limits=off")
    q = BODY.rest_qpos
    for k in range(30):
        q[7:] = BODY.rest_q + 0.05 * np.sin(0.2 * k) * BODY.spread_rad
        q[7:] = np.clip(q[7:], *BODY.range_rad.T)
        assert limited.apply(*pose(q), DT)[1] == pytest.approx(free.apply(*pose(q), DT)[1], abs=2e-3)


def test_the_displacement_limit_holds_after_the_filter_has_overshot():
    conditioning, last = after("displacement_limit=after", "smoothing=holt:after"), None
    for q in jumping_between_ends():
        root, rotations = conditioning.apply(*pose(q), DT)
        local = local_rotations(rotations)
        if last is not None:
            assert np.linalg.norm(root - last[0]) / DT <= DEFAULT_M_S["hips"] + 1e-6
            turn = Rotation.from_matrix(np.einsum("jba,jbc->jac", last[1], local)).magnitude() / DT
            forearm = OUTPUT_JOINTS.index("LeftForeArm")
            bone = np.linalg.norm(BODY.skeleton.offsets_m[OUTPUT_JOINTS.index("LeftHand")])
            assert turn[forearm] * bone <= 1.1 * DEFAULT_M_S["left_wrist"], "a tenth for the ranges"
        last = (root, local)


def test_fingers_are_limited_too():
    conditioning = after("displacement_limit=after")
    root, rotations = pose(BODY.rest_qpos)
    conditioning.apply(root, rotations, DT)
    finger, parent = (OUTPUT_JOINTS.index(name) for name in ("LeftHandIndex1", "LeftHand"))
    bone = np.linalg.norm(BODY.skeleton.offsets_m[OUTPUT_JOINTS.index("LeftHandIndex2")])
    bent = rotations.copy()
    bent[finger] = rotations[parent] @ Rotation.from_rotvec([0, 1.4, 0]).as_matrix()
    _, out = conditioning.apply(root, bent, DT)
    turned = Rotation.from_matrix(out[parent].T @ out[finger]).magnitude()
    assert turned == pytest.approx(1.0 * DT / bone, rel=1e-6)


def test_joints_without_a_humanoid_are_limited_and_smoothed():
    for assignments in (("displacement_limit=after",), ("smoothing=holt:after",)):
        conditioning, wrist = after(*assignments, solved=False), INDEX["left_wrist"]
        joints = standing()
        conditioning.joints(joints, DT)
        jumped = joints.copy()
        jumped[wrist] += [0.0, -0.6, 0.0]
        step = np.linalg.norm(conditioning.joints(jumped, DT)[wrist] - joints[wrist])
        assert 0 < step < 0.5
    limited = after("displacement_limit=after", "displacement_limits_m_s.left_wrist=0.3", solved=False)
    limited.joints(standing(), DT)
    assert limited.joints(jumped, DT)[wrist] - standing()[wrist] == pytest.approx([0, -0.3 * DT, 0])
    assert CANONICAL[PARENTS[wrist]] == "left_elbow"


def test_nothing_is_done_unless_asked():
    conditioning = after()
    root, rotations = pose(BODY.rest_qpos)
    assert not conditioning.active
    assert conditioning.apply(root, rotations, DT)[1] is rotations
    assert conditioning.joints(root, DT) is root

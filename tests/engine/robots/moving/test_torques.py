"""Torques of a robot's motion are those of inverse dynamics, and kept within the limits that a model gives."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.engine.robots.body.robot import INDEX, POINTS, Robot, build_robot
from studio.engine.robots.figures import robot_figures
from studio.engine.robots.moving.gave_way import TOLD_M, GaveWay, gave_way, gave_way_text
from studio.engine.robots.moving.kinematics import RobotKinematics
from studio.engine.robots.moving.performed import performed
from studio.engine.robots.moving.solver import Retargeting
from studio.engine.robots.moving.targets import targets_of
from studio.engine.robots.moving.torque_rows import SIGMA_SHARE, LinearTorques
from studio.engine.robots.moving.torques import KEPT_SHARE, RobotTorques
from studio.engine.robots.moving.whole_take import retargeted, retargeted_and_told
from studio.engine.robots.strain import strain_text, torque_shares
from studio.engine.whole_take.finish.trajectory import moved
from tests.engine.robots import models

MOTORS = """<actuator>
<motor joint="l_k_pitch0" gear="2" ctrlrange="-30 40"/>
<position joint="r_k_pitch0" kp="50" forcerange="-25 25"/>
<position joint="w_yaw0" kp="50"/>
</actuator></mujoco>"""


def child(folder: Path) -> Robot:
    return build_robot(models.written(folder, models.child().replace("</mujoco>", MOTORS)), "child")


def test_limits_are_read_of_motors_forces_and_a_urdf_s_efforts(tmp_path: Path):
    robot = child(tmp_path)
    limits = dict(zip(robot.joint_names, robot.torque_nm.tolist(), strict=True))
    assert limits["l_k_pitch0"] == [-60.0, 80.0]
    assert limits["r_k_pitch0"] == [-25.0, 25.0]
    assert limits["w_yaw0"] == [-np.inf, np.inf]
    urdf = build_robot(models.written(tmp_path, models.urdf(), "robot.urdf"), "urdf")
    assert (urdf.torque_nm == [-50.0, 50.0]).all()


def test_the_torques_of_a_stance_are_mujocos(tmp_path: Path):
    """Those that no foot's force goes through; and a leg's hold the weight, which the floor carries."""
    robot = child(tmp_path)
    q = robot.standing
    q[7:] = np.where([name.startswith(("l_s", "r_s")) for name in robot.joint_names], 0.3, q[7:])
    limited = replace(robot, torque_nm=np.tile([-1.0, 1.0], (len(q) - 7, 1)))
    shares = RobotTorques(limited, 0.01).strain(np.tile(q, (4, 1))).shares[0]
    data = mujoco.MjData(robot.model)
    data.qpos[:] = q
    robot.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    mujoco.mj_inverse(robot.model, data)
    arms = [k for k, name in enumerate(robot.joint_names) if name.startswith(("l_s", "r_s", "l_e", "r_e"))]
    assert np.allclose(shares[arms], np.abs(data.qfrc_inverse[6:][arms]), atol=1e-3)


def test_torques_of_weak_arms_are_kept_within_their_limits(tmp_path: Path, test_data: Path):
    robot = child(tmp_path)
    walk = frames_of(imported_poses(test_data / "mocap" / "02_03.bvh")[0], slice(1, 60))
    targets = targets_of(robot, performed(walk))
    free = replace(robot, torque_nm=np.tile([-1.0, 1.0], (robot.active.size, 1)))
    before = retargeted(robot, targets, Retargeting(strength=False))
    most = RobotTorques(free, targets.frame_s).strain(before).shares.max(axis=0)
    arms = [name.startswith(("l_s", "r_s", "l_e", "r_e")) for name in robot.joint_names]
    weak = replace(robot, torque_nm=np.where(arms, 0.8 * most, np.inf)[:, None] * [-1.0, 1.0])
    near = robot_figures(weak, retargeted(weak, targets, Retargeting(give_way=False)), targets)
    q, told = retargeted_and_told(weak, targets)
    kept, loose = robot_figures(weak, q, targets), robot_figures(weak, before, targets)
    assert loose.torque_share is not None
    assert near.torque_share is not None
    assert near.torque_share < 0.5 * loose.torque_share
    assert near.key_point_mm < loose.key_point_mm + 10.0
    assert kept.torque_share == 0.0
    assert kept.strained == ()
    assert kept.key_point_mm < loose.key_point_mm + 30.0
    assert kept.limit_share == kept.velocity_share == 0.0
    assert kept.self_penetration_share <= 0.01
    assert told
    assert all(one.most_m > TOLD_M and one.begin_s <= one.end_s for one in told)
    first = loose.strained[0]
    assert first.frame_share == max(one.frame_share for one in loose.strained)
    assert max(one.most for one in loose.strained) == loose.torque_most
    shares = torque_shares(weak, before, targets.frame_s)
    assert shares is not None
    at = shares[round(first.at_s / targets.frame_s) - 1, weak.joint_names.index(first.joint)]
    assert at == first.most > 1.0
    assert strain_text(loose.strained).startswith(f"torques beyond limits: {first.joint} in ")
    assert strain_text(()) == "torques beyond limits: none"


def test_rows_tell_how_torques_change(tmp_path: Path):
    """As inverse dynamics does after a small step, of a robot that stands and sways."""
    robot = child(tmp_path)
    robot = replace(robot, torque_nm=np.tile([-1.0, 1.0], (len(robot.standing) - 7, 1)))
    frame_s, frames = 0.01, 5
    kinematics, torques = RobotKinematics(robot), RobotTorques(robot, frame_s)
    way = np.random.default_rng(3).normal(size=(2, frames, len(kinematics.dofs)))
    q = moved(np.tile(kinematics.reduced(robot.standing[None]), (frames, 1)), 1e-5 * way[0])
    rows = LinearTorques(robot, kinematics.dofs, frame_s).rows(torques.strain(kinematics.whole(q)))
    step = 1e-8 * way[1]
    before, after = (torques.strain(kinematics.whole(one)).shares for one in (q, moved(q, step)))
    at = np.argwhere(before > 0.8)
    seen = (rows.beyond * SIGMA_SHARE + KEPT_SHARE)[:, None]
    change = (rows.after(step) - rows.beyond) * SIGMA_SHARE
    for frame, hinge in at:
        mine = (rows.frames == frame) & (np.abs(seen[:, 0] - before[frame, hinge]) < 1e-9)
        assert mine.any()
        assert (
            np.abs(change[mine] - (after - before)[frame, hinge]).min() < 1e-3 * np.abs(after - before).max()
        )


def test_forces_pass_to_a_foot_that_comes_down_over_some_height(tmp_path: Path):
    """From 3 cm over the floor to 1 cm, no torque changes by more than a fifth of its whole change in 0.25 mm."""
    robot = child(tmp_path)
    robot = replace(robot, torque_nm=np.tile([-1.0, 1.0], (len(robot.standing) - 7, 1)))
    knee, hip, ankle = (robot.joint_names.index(f"l_{name}") for name in ("k_pitch0", "h_pitch2", "a_pitch0"))
    torques, shares, heights = RobotTorques(robot, 0.01), [], []
    for bend in np.linspace(0.2, 0.8, 160):
        q = robot.standing.copy()
        q[7 + np.array([hip, knee, ankle])] += [-0.5 * bend, bend, -0.5 * bend]
        strain = torques.strain(np.tile(q, (3, 1)))
        shares.append(strain.shares[0])
        heights.append(strain.soles_m[0, :4, 2].min())
    order, near = np.argsort(heights), (np.sort(heights) > 0.01) & (np.sort(heights) < 0.03)
    height, share = np.array(heights)[order][near], np.array(shares)[order][near]
    assert height[0] < 0.012
    assert height[-1] > 0.028
    most = np.ptp(share, axis=0).max()
    assert most > 1.0
    at = np.arange(height[0], height[-1], 0.00025)
    even = np.stack([np.interp(at, height, one) for one in share.T], axis=1)
    assert np.abs(np.diff(even, axis=0)).max() < 0.2 * most


def test_where_a_motion_gave_way_is_told():
    before = np.zeros((100, len(POINTS), 3))
    after = before.copy()
    after[20:30, INDEX["left_knee"], 0] = 0.1
    after[35:41, INDEX["right_hand"], 2] = 0.2
    after[80:90, INDEX["right_hand"], 2] = 0.02
    told = gave_way(before, after, 0.01)
    assert told == (GaveWay(0.2, 0.4, 0.2, "right_hand"),)
    assert (
        gave_way_text(told, 1.0)
        == "gave way in pose for its torques: 1.20 to 1.40 s by up to 20 cm (right_hand)"
    )
    assert gave_way_text(()) == "gave way in pose for its torques: never"

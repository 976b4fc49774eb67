"""Torques of a robot's motion are those of inverse dynamics, and kept nearer to the limits that a model gives."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.engine.robots.body.robot import Robot, build_robot
from studio.engine.robots.figures import robot_figures
from studio.engine.robots.moving.performed import performed
from studio.engine.robots.moving.targets import targets_of
from studio.engine.robots.moving.torques import RobotTorques
from studio.engine.robots.moving.whole_take import Retargeting, retargeted
from studio.engine.robots.strain import strain_text, torque_shares
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
    shares = RobotTorques(limited, 0.01).shares(np.tile(q, (4, 1)))[0]
    data = mujoco.MjData(robot.model)
    data.qpos[:] = q
    robot.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    mujoco.mj_inverse(robot.model, data)
    arms = [k for k, name in enumerate(robot.joint_names) if name.startswith(("l_s", "r_s", "l_e", "r_e"))]
    assert np.allclose(shares[arms], np.abs(data.qfrc_inverse[6:][arms]), atol=1e-3)


def test_torques_of_weak_arms_are_kept_nearer_to_their_limits(tmp_path: Path, test_data: Path):
    robot = child(tmp_path)
    walk = frames_of(imported_poses(test_data / "mocap" / "02_03.bvh")[0], slice(1, 90))
    targets = targets_of(robot, performed(walk))
    free = replace(robot, torque_nm=np.tile([-1.0, 1.0], (robot.active.size, 1)))
    before = retargeted(robot, targets, Retargeting(strength=False))
    most = np.abs(RobotTorques(free, targets.frame_s).shares(before)).max(axis=0)
    arms = [name.startswith(("l_s", "r_s", "l_e", "r_e")) for name in robot.joint_names]
    weak = replace(robot, torque_nm=np.where(arms, 0.8 * most, np.inf)[:, None] * [-1.0, 1.0])
    kept = robot_figures(weak, retargeted(weak, targets), targets)
    loose = robot_figures(weak, before, targets)
    assert loose.torque_share is not None
    assert kept.torque_share is not None
    assert kept.torque_share < 0.7 * loose.torque_share
    assert kept.key_point_mm < loose.key_point_mm + 10.0
    assert kept.limit_share == kept.velocity_share == 0.0
    first = loose.strained[0]
    assert first.frame_share == max(one.frame_share for one in loose.strained)
    assert max(one.most for one in loose.strained) == loose.torque_most
    shares = torque_shares(weak, before, targets.frame_s)
    assert shares is not None
    at = shares[round(first.at_s / targets.frame_s) - 1, weak.joint_names.index(first.joint)]
    assert at == first.most > 1.0
    assert strain_text(loose.strained).startswith(f"torques beyond limits: {first.joint} in ")
    assert strain_text(()) == "torques beyond limits: none"

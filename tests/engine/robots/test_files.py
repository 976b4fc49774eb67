"""Robots are kept in tables that can be corrected, and their motions in files that can be read again."""

import json
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.robots.body.robot import build_robot
from studio.engine.robots.describe import robot_facts
from studio.engine.robots.files import add_robot, kept_robots, load_robot, remove_robot
from studio.engine.robots.motion import RobotMotion, load_motion, write_motion
from tests.engine.robots import models


def test_a_kept_robot_is_loaded_with_its_corrections(tmp_path: Path):
    model = models.written(tmp_path, models.child())
    added = add_robot(tmp_path / "robots", model, "child", velocity_rad_s=5.0)
    path = tmp_path / "robots" / "child.json"
    table = json.loads(path.read_text())
    table["parts"]["head"] = "base"
    table["velocity_rad_s"]["l_k_pitch0"] = 2.0
    path.write_text(json.dumps(table))
    robot = load_robot(tmp_path / "robots", "child")
    assert robot.parts == {**added.parts, "head": "base"}
    assert robot.velocity_rad_s[robot.joint_names.index("l_k_pitch0")] == 2.0
    assert kept_robots(tmp_path / "robots") == ["child"]
    remove_robot(tmp_path / "robots", "child")
    assert kept_robots(tmp_path / "robots") == []
    assert model.is_file()


def test_what_is_wrong_with_a_kept_robot_is_said(tmp_path: Path):
    folder = tmp_path / "robots"
    model = models.written(tmp_path, models.child())
    with pytest.raises(FormatError, match="no robot 'child'"):
        load_robot(folder, "child")
    with pytest.raises(FormatError, match="no robot 'child'"):
        remove_robot(folder, "child")
    with pytest.raises(FormatError, match="letters, digits"):
        add_robot(folder, model, "../child")
    add_robot(folder, model, "child")
    model.write_text(models.short_legs())
    with pytest.raises(FormatError, match="not as it was"):
        load_robot(folder, "child")
    model.unlink()
    with pytest.raises(FormatError, match="is gone"):
        load_robot(folder, "child")
    (folder / "child.json").write_text("{}")
    with pytest.raises(FormatError, match="no table of a robot"):
        load_robot(folder, "child")


def test_a_motion_is_written_and_read_again(tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    rng = np.random.default_rng(5)
    q = np.tile(robot.standing, (7, 1)) + 0.1 * rng.normal(size=(7, robot.model.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    motion = RobotMotion("child", robot.joint_names, 2.0 + np.arange(7) / 30.0, q)
    write_motion(motion, tmp_path / "motion.npz", "npz")
    again = load_motion(tmp_path / "motion.npz", robot)
    assert np.array_equal(again.qpos, q)
    assert np.array_equal(again.time_s, motion.time_s)
    write_motion(motion, tmp_path / "motion.csv", "csv")
    rows = np.loadtxt(tmp_path / "motion.csv", delimiter=",")
    assert rows.shape == (7, 7 + len(robot.joint_names))
    assert np.allclose(rows[:, 3:7], q[:, [4, 5, 6, 3]], atol=1e-6)  # x, y, z, w
    assert np.allclose(load_motion(tmp_path / "motion.csv", robot).qpos, q, atol=1e-6)


def test_a_motion_of_another_robot_is_refused(tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    other = RobotMotion("other", ("a",), np.arange(2) / 30.0, np.zeros((2, 8)))
    other.save(tmp_path / "other.npz")
    with pytest.raises(FormatError, match="another robot"):
        load_motion(tmp_path / "other.npz", robot)
    (tmp_path / "bad.npz").write_bytes(b"nothing")
    with pytest.raises(FormatError, match="no motion of a robot"):
        load_motion(tmp_path / "bad.npz", robot)
    with pytest.raises(SettingsError, match="csv"):
        write_motion(other, tmp_path / "x.fbx", "fbx")


def test_facts_name_what_was_assumed(tmp_path: Path):
    free = build_robot(models.written(tmp_path, models.humanoid(limit="")), "free")
    facts = robot_facts(free)
    limits, torques = facts.notes
    assert all(name in limits for name in free.joint_names)
    assert "no torque limits" in torques
    assert facts.moved == len(free.joint_names)
    assert facts.leg_m == pytest.approx(0.44)

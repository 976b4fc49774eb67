"""Robots are read, their parts found, and measured; what is no humanoid is refused in one line."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.robots.body.reading import UNLIMITED_RAD
from studio.engine.robots.body.robot import INDEX, build_robot
from studio.engine.robots.body.shapes import robot_shapes
from tests.engine.robots import models

UNITREE = {
    "unitree_g1/g1.xml": {
        "pelvis": "pelvis", "torso": "torso_link", "left_hip": "left_hip_roll_link", "left_knee": "left_knee_link",
        "left_foot": "left_ankle_roll_link", "right_elbow": "right_elbow_pitch_link",
        "right_hand": "right_elbow_roll_link",
    },
    "unitree_h1/h1.xml": {
        "pelvis": "pelvis", "torso": "torso_link", "left_hip": "left_hip_roll_link", "left_knee": "left_knee_link",
        "left_foot": "left_ankle_link", "right_elbow": "right_elbow_link", "right_hand": "right_elbow_link",
    },
}  # fmt: skip


@pytest.mark.parametrize("file", UNITREE)
def test_parts_of_unitree_robots_are_found(file: str, test_data: Path):
    robot = build_robot(test_data / "robots" / file, "robot")
    assert {part: robot.parts[part] for part in UNITREE[file]} == UNITREE[file]
    assert robot.collides
    assert (robot.rest >= robot.range_rad[:, 0]).all()
    assert (robot.rest <= robot.range_rad[:, 1]).all()


def test_the_g1_is_measured(test_data: Path):
    robot = build_robot(test_data / "robots" / "unitree_g1" / "g1.xml", "g1")
    front, back = robot.at_rest_m[INDEX["left_toe_in"]], robot.at_rest_m[INDEX["left_heel_in"]]
    assert front[0] - back[0] == pytest.approx(0.192, abs=1e-3)  # of the model's four spheres of 1 mm
    assert robot.ankle_m[0, 2] == pytest.approx(0.031, abs=1e-3)
    assert int(robot.active.sum()) == 23
    fingers = [name for name, moves in zip(robot.joint_names, robot.active, strict=True) if not moves]
    assert len(fingers) == 14


@pytest.mark.parametrize("upper", [models.child, models.short_legs])
def test_robots_without_telling_names_are_measured_by_their_joints(upper, tmp_path: Path):
    robot = build_robot(models.written(tmp_path, upper()), "made")
    leg, arm = (0.2, 0.13) if upper is models.child else (0.14, 0.2)
    assert robot.parts["left_knee"] == "l_k_pitch0"
    assert robot.parts["right_elbow"].startswith("r_e")
    assert robot.lengths_m["thigh"] == pytest.approx(leg, abs=1e-6)
    assert robot.lengths_m["shank"] == pytest.approx(leg, abs=1e-6)
    assert robot.lengths_m["upper_arm"] == pytest.approx(arm, abs=1e-6)
    assert robot.at_rest_m[INDEX["left_heel_in"], 2] == pytest.approx(0.0, abs=1e-9)
    assert robot.active.all()


def test_five_waist_joints_hang_between_pelvis_and_torso(tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    assert (robot.parts["pelvis"], robot.parts["torso"]) == ("base", "w_yaw4")


def test_a_urdf_keeps_its_first_link_and_its_velocities(tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.urdf(), "robot.urdf"), "urdf")
    assert robot.parts["pelvis"] == "pelvis"
    assert (robot.velocity_rad_s == 7.0).all()
    assert robot.height_m > 1.1, "its points count: only its feet have geometry"


def test_joints_without_limits_get_half_a_turn_to_both_sides(tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.humanoid(limit="")), "free")
    assert robot.unlimited == robot.joint_names
    assert np.allclose(robot.range_rad, [-UNLIMITED_RAD, UNLIMITED_RAD])


def test_a_part_is_corrected(tmp_path: Path):
    path = models.written(tmp_path, models.child())
    assert build_robot(path, "child", parts={"head": "base"}).parts["head"] == "base"
    assert build_robot(path, "child", velocity_rad_s={"l_k_pitch0": 3.0}).velocity_rad_s.min() == 3.0


SLIDER = models.child().replace('name="l_k_pitch0" axis', 'type="slide" name="l_k_pitch0" axis')
REFUSED = {
    "robot.not_humanoid": ({}, models.quadruped(), "4 legs reach the floor"),
    "robot.not_humanoid ": ({}, models.humanoid(feet=False), "no feet"),
    "robot.not_humanoid  ": ({}, models.arms_alone(), "no two feet"),
    "robot.unreadable": ({}, "<mujoco><worldb", "is no robot's model"),
    "robot.no_joints": ({}, "<mujoco><worldbody/></mujoco>", "no joints"),
    "robot.mesh_missing": ({}, models.urdf("package://made/meshes/x.stl"), "x.stl"),
    "robot.joint_kind": ({}, SLIDER, "no hinge"),
    "robot.no_part": ({"parts": {"tail": "base"}}, models.child(), "tail"),
    "robot.no_body": ({"parts": {"head": "nobody"}}, models.child(), "nobody"),
    "robot.no_limb": ({"parts": {"left_hand": "base"}}, models.child(), "left_hand"),
    "robot.no_joint": ({"velocity_rad_s": {"nothing": 1.0}}, models.child(), "nothing"),
    "robot.velocity": ({"velocity_rad_s": -1.0}, models.child(), "above 0"),
}  # fmt: skip


@pytest.mark.parametrize("code", REFUSED)
def test_what_is_no_humanoid_is_refused_in_one_line(code: str, tmp_path: Path):
    options, text, told = REFUSED[code]
    with pytest.raises(FormatError, match=told) as refused:
        build_robot(models.written(tmp_path, text), "made", **options)
    assert refused.value.code == code.strip()
    assert "\n" not in str(refused.value)


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(FormatError, match="none"):
        build_robot(tmp_path / "none.xml", "none")


def test_a_robot_without_meshes_has_capsules_where_its_bodies_have_nothing(tmp_path: Path):
    """A URDF whose feet alone have geometry: its legs, trunk and arms are seen too."""
    robot = build_robot(models.written(tmp_path, models.urdf(), "bare.urdf"), "bare")
    bodies = [robot.model.body(shape.body).name for shape in robot_shapes(robot)]
    assert {"left_ankle_roll", "left_knee", "torso", "right_elbow"} <= set(bodies)
    assert bodies.count("left_ankle_roll") == 1

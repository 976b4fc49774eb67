"""Robots follow a performer: within limits, with standing feet, apart from themselves, and closely."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.engine.base.errors import FormatError
from studio.engine.model.poses import Poses
from studio.engine.robots.body.robot import INDEX, Robot, build_robot
from studio.engine.robots.figures import robot_figures
from studio.engine.robots.moving.balance import outside
from studio.engine.robots.moving.kinematics import RobotKinematics
from studio.engine.robots.moving.live import followed
from studio.engine.robots.moving.per_frame import PerFrame, part_turns
from studio.engine.robots.moving.performed import performed
from studio.engine.robots.moving.solver import Retargeting, within_velocity
from studio.engine.robots.moving.targets import targets_of, tilt_heights
from studio.engine.robots.moving.whole_take import retargeted
from studio.engine.whole_take.finish.trajectory import moved
from tests.engine.robots import models

FRAMES = slice(1, 110)


@cache
def poses_of(clip: Path) -> Poses:
    return frames_of(imported_poses(clip)[0], FRAMES)


@pytest.fixture
def walk(test_data: Path) -> Poses:
    return poses_of(test_data / "mocap" / "02_01.bvh")


@pytest.fixture(params=["child", "short legs", "g1", pytest.param("h1", marks=pytest.mark.long)])
def robot(request, tmp_path: Path, test_data: Path) -> Robot:
    name = request.param
    if name in ("g1", "h1"):
        return build_robot(test_data / "robots" / f"unitree_{name}" / f"{name}.xml", name)
    return build_robot(
        models.written(tmp_path, models.child() if name == "child" else models.short_legs()), name
    )


def test_a_walk_is_followed(robot: Robot, walk: Poses):
    targets = targets_of(robot, performed(walk))
    figures = robot_figures(robot, retargeted(robot, targets), targets)
    assert figures.limit_share == figures.velocity_share == 0.0
    assert figures.foot_slide_cm_s is not None
    assert figures.foot_slide_cm_s < 1.0
    assert figures.floor_penetration_share <= 0.01
    assert figures.self_penetration_share <= 0.01
    assert figures.key_point_mm < 0.06 * 1000.0 * robot.leg_m


def test_every_frame_is_answered_live_within_limits(robot: Robot, walk: Poses):
    motion = performed(walk)
    q, _ = followed(robot, motion)
    figures = robot_figures(robot, q, targets_of(robot, motion))
    assert np.isfinite(q).all()
    assert figures.limit_share == figures.velocity_share == 0.0
    assert figures.key_point_mm < 0.15 * 1000.0 * robot.leg_m


def test_the_live_way_needs_no_later_frame(walk: Poses, tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    motion = performed(walk)
    whole, _ = followed(robot, motion)
    first, _ = followed(robot, motion.part(slice(0, 60)))
    assert np.array_equal(whole[:60], first)


def test_the_baseline_slides_more_and_is_less_smooth(walk: Poses, tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.short_legs()), "short")
    motion = performed(frames_of(walk, slice(0, 60)))
    targets = targets_of(robot, motion)
    usual = robot_figures(robot, PerFrame(robot).solve(targets, part_turns(robot, motion, targets)), targets)
    whole = robot_figures(robot, retargeted(robot, targets), targets)
    assert usual.foot_slide_cm_s is not None
    assert whole.foot_slide_cm_s is not None
    assert whole.foot_slide_cm_s < 0.2 * usual.foot_slide_cm_s
    assert whole.acceleration_rad_s2 < 0.5 * usual.acceleration_rad_s2


def test_derivatives_of_points_contacts_and_mass_are_those_of_small_steps(tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.short_legs()), "short")
    kinematics = RobotKinematics(robot)
    q = kinematics.reduced(robot.standing[None])
    q[0, 2] -= 0.004
    q[0, 3:7] = [0.9995, 0.02, 0.02, 0.01]
    q[0, 3:7] /= np.linalg.norm(q[0, 3:7])
    at = kinematics.linearised(q, contacts=True, mass=True)
    assert at.contacts is not None
    assert at.mass_jacobians is not None
    step = np.random.default_rng(3).normal(size=(1, q.shape[1] - 1)) * 1e-6
    after = kinematics.linearised(moved(q, step), contacts=True)
    assert after.contacts is not None
    points = (at.jacobians[0] @ step[0]).reshape(-1, 3)
    assert np.allclose(after.points_m[0] - at.points_m[0], points, atol=1e-10)
    assert np.allclose(after.mass_m[0] - at.mass_m[0], at.mass_jacobians[0] @ step[0], atol=1e-10)
    floor = (at.contacts.bodies == 0).any(axis=1)
    assert floor.any()
    changed = after.contacts.distance_m - at.contacts.distance_m
    assert np.allclose(changed[floor], (at.contacts.rows @ step[0])[floor], atol=1e-9)


def test_balance_brings_the_mass_over_the_feet(walk: Poses, tmp_path: Path):
    """A performer who stands still and leans: without balance the robot would fall."""
    still = frames_of(walk, slice(0, 30))
    one = np.repeat(still.positions_m[:1], 30, axis=0)
    turns = np.repeat(still.rotations_wxyz[:1], 30, axis=0)
    feet = [
        still.joint_names.index(name) for name in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")
    ]
    upper = [k for k in range(one.shape[1]) if k not in feet]
    one[:, upper, 0] += 0.3
    leaning = Poses(
        still.time_s, still.joint_names, still.parents, one, turns, still.confidence, still.uncertainty_mm
    )
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    targets = targets_of(robot, performed(leaning))
    plain = robot_figures(robot, retargeted(robot, targets), targets)
    balanced = robot_figures(robot, retargeted(robot, targets, Retargeting(balance=True)), targets)
    assert plain.balance_share == 0.0
    assert balanced.balance_share == 1.0


def test_the_way_into_a_support():
    soles = np.zeros((1, 2, 4, 3))
    soles[0, 0, :, :2] = [[0, 0], [0, 1], [1, 0], [1, 1]]
    standing = np.zeros((1, 2, 4), dtype=bool)
    standing[0, 0] = True
    assert np.allclose(outside(np.array([[0.5, 0.5, 1.0]]), soles, standing), 0.0)
    assert np.allclose(outside(np.array([[1.5, 0.5, 1.0]]), soles, standing), [[-0.5, 0.0]])
    assert np.allclose(outside(np.array([[1.5, 0.5, 1.0]]), soles, ~standing & False), 0.0)


def test_angles_are_slowed_down_only_where_they_are_too_fast():
    angles = np.concatenate([np.linspace(0.0, 0.2, 101), np.full(50, 0.5), np.full(50, 0.1)])[:, None]
    slow = within_velocity(angles, np.array([0.02]))
    assert np.abs(np.diff(slow, axis=0)).max() <= 0.02 + 1e-12
    assert np.allclose(slow[:80], angles[:80])
    assert slow.min() >= angles.min()
    assert slow.max() <= angles.max()
    assert np.array_equal(within_velocity(angles[:101], np.array([0.02])), angles[:101])


def test_standing_corners_have_one_place_for_a_stance(walk: Poses, tmp_path: Path):
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    targets = targets_of(robot, performed(walk))
    corner = targets.points_m[:, INDEX["left_toe_in"]]
    stands = targets.standing[:, 0, 2]
    assert stands.any()
    both = stands[1:] & stands[:-1]
    assert np.abs(np.diff(corner, axis=0)[both]).max() < 1e-3
    assert np.allclose(corner[stands, 2], 0.0)


def test_a_sole_that_cannot_be_flat_stands_on_its_lower_edge():
    """Its edges are over the floor by what it is tilted; a heel over the toes is pulled down."""
    soles = np.zeros((1, 2, 4, 3))
    soles[0, :, :, 2] = [[0.04, 0.05, 0.0, 0.01], [-0.004, 0.004, -0.004, 0.004]]
    hold = np.ones((1, 2, 4))
    hold[0, 1, 2:] = 0.5
    wanted = [[0.0, 0.01, 0.0, 0.01], [0.0, 0.008, 0.0, 0.004]]
    assert np.allclose(tilt_heights(soles, hold)[0], wanted)


def test_a_motion_without_arms_is_refused(walk: Poses):
    names = tuple("Other" if name == "LeftHand" else name for name in walk.joint_names)
    armless = Poses(
        walk.time_s,
        names,
        walk.parents,
        walk.positions_m,
        walk.rotations_wxyz,
        walk.confidence,
        walk.uncertainty_mm,
    )
    with pytest.raises(FormatError, match="LeftHand"):
        performed(armless)
    with pytest.raises(FormatError, match="3 frames"):
        performed(frames_of(walk, slice(0, 3)))


def test_hands_touch_where_the_performer_s_do(walk: Poses, tmp_path: Path):
    """A performer holds an elbow, and then has the other hand on the floor."""
    still = frames_of(walk, slice(0, 30))
    at = np.repeat(still.positions_m[:1], 30, axis=0)
    turns = np.repeat(still.rotations_wxyz[:1], 30, axis=0)
    place = {name: still.joint_names.index(name) for name in still.joint_names}
    ahead = np.cross(at[0, place["LeftUpLeg"]] - at[0, place["RightUpLeg"]], [0.0, 0.0, 1.0])
    ahead /= np.linalg.norm(ahead)
    down = np.array([0.0, 0.0, -1.0])
    at[:, place["RightForeArm"]] = at[:, place["RightArm"]] + 0.2 * ahead + 0.2 * down
    at[:, place["LeftForeArm"]] = at[:, place["LeftArm"]] + 0.2 * ahead + 0.2 * down
    at[:, place["LeftHand"]] = at[:, place["RightForeArm"]] + 0.06 * ahead
    at[:, place["RightHand"]] = at[:, place["RightForeArm"]] + 0.3 * down
    robot = build_robot(models.written(tmp_path, models.child()), "child")
    targets = targets_of(robot, performed(replace(still, positions_m=at, rotations_wxyz=turns)))
    points = RobotKinematics(robot)
    placed = points.linearised(points.reduced(retargeted(robot, targets))).points_m[15]
    assert np.linalg.norm(placed[INDEX["left_hand"]] - placed[INDEX["right_elbow"]]) < 0.06
    at[:, place["RightHand"], 2] = 0.05
    targets = targets_of(robot, performed(replace(still, positions_m=at, rotations_wxyz=turns)))
    assert targets.points_m[15, INDEX["right_hand"], 2] < 0.06
    assert targets.sigma_m[15, INDEX["right_hand"], 2] < 0.006

"""Floor contact: no foot under the floor, a standing foot stays, a jump is released."""

import numpy as np
import pytest

from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, JOINT_COUNT, OUTPUT_INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.completion.floor import LEAST_HEIGHT, FloorContact
from studio.engine.solve.pipeline import Pipeline
from tests.engine.walkers import SECOND, camera_frame, performer, stage, standing

DT = 1 / 60
FEET = [INDEX[n] for n in ("left_ankle", "left_toe", "right_ankle", "right_toe")]
OUTPUT_FEET = [OUTPUT_INDEX[n] for n in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")]
REST_M = Skeleton.of(performer()).rest_positions_m[OUTPUT_FEET, 2]
SIGMA = np.full(JOINT_COUNT, 0.02)


def solved(joints_at, seconds, *assignments, start_s=1.0):
    """Feet of the pipeline's poses, shape (frame_count, 4, 3), from joints seen by two ideal cameras at 60 Hz."""
    calibration = stage(-35.0, 35.0)
    pipeline = Pipeline(calibration, parse_settings("studio", assignments))
    feet = []
    for k in range(round(seconds / DT)):
        time_s = start_s + k * DT
        for camera in calibration.cameras:
            pipeline.add_frame(camera_frame(calibration, camera, time_s, joints_at(k * DT)))
        feet.append(pipeline.step(round(time_s * SECOND)).positions_m[OUTPUT_FEET])
    return np.array(feet)


def test_no_foot_is_under_the_floor_whatever_the_joints():
    def sinking(time_s):
        return standing() - [0, 0, 0.25 * time_s]

    feet = solved(sinking, 1.5)
    assert (feet[:, :, 2] >= LEAST_HEIGHT * REST_M - 1e-9).all()
    without = solved(sinking, 1.5, "floor_contact=off")
    assert without[-1, :, 2].min() < -0.1


def test_a_standing_foot_is_held_against_noise():
    rng = np.random.default_rng(1)

    def noisy(time_s):
        joints = standing()
        joints[FEET] += rng.normal(0, 0.008, (4, 3)) + np.array([0.01 * np.sin(2 * np.pi * time_s), 0, 0])
        return joints

    held, free = solved(noisy, 2.0)[60:], solved(noisy, 2.0, "floor_contact=off")[60:]
    for foot in range(4):
        speed = np.linalg.norm(np.diff(held[:, foot], axis=0), axis=1).mean() / DT
        free_speed = np.linalg.norm(np.diff(free[:, foot], axis=0), axis=1).mean() / DT
        assert speed < 0.7 * free_speed
        assert np.linalg.norm(held[:, foot].mean(axis=0) - standing()[FEET[foot]]) < 0.02


def test_a_jump_is_released_and_lands():
    def jumping(time_s):
        flight = np.clip((time_s - 1.0) / 0.6, 0, 1)
        return standing() + np.array([0.3 * flight, 0, 4 * 0.4 * flight * (1 - flight)])

    feet = solved(jumping, 2.5)
    top = feet[round(1.3 / DT)]
    assert np.abs(top[:, 2] - standing()[FEET, 2] - 0.4).max() < 0.08, "off the ground, not held down"
    assert np.linalg.norm(feet[-1] - standing()[FEET] - np.array([0.3, 0, 0]), axis=1).max() < 0.03
    assert (feet[:, :, 2] >= LEAST_HEIGHT * REST_M - 1e-9).all()


def test_a_slide_is_followed():
    def sliding(time_s):
        return standing() + np.array([0.3 * max(time_s - 0.5, 0.0), 0, 0])

    feet = solved(sliding, 3.0)
    assert np.linalg.norm(feet[-1] - standing()[FEET] - np.array([0.75, 0, 0]), axis=1).max() < 0.08


def test_a_heel_may_rise_while_the_toe_stays():
    floor = FloorContact(Skeleton.of(performer()))
    for k in range(120):
        joints = standing()
        joints[INDEX["left_ankle"], 2] += min(0.15, 0.15 * max(k - 60, 0) / 30)
        joints[INDEX["left_toe"], 0] += 0.004 * (-1) ** k
        out, sigma = floor.targets(joints, SIGMA, DT)
    assert out[INDEX["left_ankle"]] == pytest.approx(joints[INDEX["left_ankle"]])
    assert abs(out[INDEX["left_toe"], 0] - standing()[INDEX["left_toe"], 0]) < 0.003
    assert sigma[INDEX["left_toe"]] < SIGMA[0] and sigma[INDEX["left_ankle"]] == SIGMA[0]


def test_a_knee_near_the_floor_or_a_foot_in_the_air_is_not_held():
    floor = FloorContact(Skeleton.of(performer()))
    joints = standing()
    joints[FEET, 2] += 0.3
    for _ in range(60):
        out, sigma = floor.targets(joints, SIGMA, DT)
    assert np.array_equal(out, joints) and np.array_equal(sigma, SIGMA)


def test_unseen_feet_stay_unseen_and_the_input_is_not_changed():
    floor = FloorContact(Skeleton.of(performer()))
    for _ in range(60):
        floor.targets(standing(), SIGMA, DT)
    joints = standing()
    joints[INDEX["left_toe"]] = np.nan
    sigma = np.where(np.isnan(joints[:, 0]), np.nan, 0.02)
    before = joints.copy()
    out, deviation = floor.targets(joints, sigma, DT)
    assert np.isnan(out[INDEX["left_toe"]]).all() and np.isnan(deviation[INDEX["left_toe"]])
    assert np.array_equal(joints, before, equal_nan=True)
    assert np.isfinite(np.delete(out, INDEX["left_toe"], axis=0)).all()


def test_lift_is_what_a_pose_lacks():
    skeleton = Skeleton.of(performer())
    floor = FloorContact(skeleton)
    assert floor.lift(skeleton.rest_positions_m) == 0.0
    sunk = skeleton.rest_positions_m - [0, 0, 0.5]
    assert (sunk[OUTPUT_FEET, 2] + floor.lift(sunk) >= LEAST_HEIGHT * REST_M - 1e-12).all()
    assert floor.lift(sunk) < 0.5

"""One performer's body: fused joints become a pose, and the output keeps the limits."""

import numpy as np
import pytest

from studio.engine.base.geometry import matrices
from studio.engine.model.frames import HandSeen
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.joints import INDEX, JOINT_COUNT, OUTPUT_INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.body import BodySolver
from tests.engine.walkers import arms_swinging, frame_set, fused, humanoid, performer

DT = 1 / 60


def run(joints_at, frames, *assignments, preset="studio", hands=()):
    """Poses (positions, rotations, confidence, uncertainty) from joints over time."""
    body = BodySolver(performer(), parse_settings(preset, assignments))
    out = []
    for k in range(frames):
        joints = joints_at(k * DT)
        seen = frame_set(k * DT, joints[None])
        out.append(body.pose(fused(joints), seen, DT))
    return out


@pytest.mark.parametrize("look_at", ["off", "far", "near", "hands", "point"])
def test_the_pose_that_leaves_is_within_the_human_limits(look_at):
    """Completion after the solve keeps them too."""
    rng, human = np.random.default_rng(1), humanoid()
    low, high = human.range_rad.T

    def wild(time_s):
        return arms_swinging(time_s) + rng.normal(0, 0.08, (JOINT_COUNT, 3))

    for positions, rotations, _, _ in run(wild, 90, f"look_at={look_at}", "look_at_point_m=1,2,0.5"):
        q = configuration_of(human, positions[0], matrices(rotations), limited=False)[7:]
        excess = np.maximum(low - q, q - high)
        worst = int(excess.argmax())
        assert excess[worst] < np.radians(0.1), human.model.joint(worst + 1).name


@pytest.mark.parametrize("flexibility", ["0", "2"])
def test_flexibility_counts_for_the_head_too(flexibility):
    poses = run(
        arms_swinging, 120, f"flexibility={flexibility}", "look_at=point", "look_at_point_m=3,0.1,1.6"
    )
    head = OUTPUT_INDEX["Head"]
    chest = OUTPUT_INDEX["Spine2"]
    rotations = matrices(poses[-1][1])
    gaze = rotations[chest].T @ -rotations[head][:, 1]
    yaw = np.degrees(np.arctan2(gaze[0], -gaze[1]))
    assert (yaw < 69) if flexibility == "0" else (yaw > 71)


def test_without_inverse_kinematics_measured_joints_stay_where_they_are():
    joints = arms_swinging(0.3) + np.random.default_rng(1).normal(0, 0.02, (JOINT_COUNT, 3))
    positions, rotations, _, _ = run(lambda t: joints, 2, preset="raw")[-1]
    assert np.abs(positions[OUTPUT_OF_CANONICAL_INDEX] - joints).max() < 1e-9
    assert np.linalg.norm(rotations, axis=1) == pytest.approx(1.0)


def test_without_inverse_kinematics_an_unseen_joint_stays_at_its_last_place():
    def vanishing(time_s):
        joints = arms_swinging(0.3)
        if time_s > 3 * DT:
            joints[INDEX["left_wrist"]] = np.nan
            joints[INDEX["hips"]] = np.nan
        return joints

    for positions, _, _, _ in run(vanishing, 10, preset="raw"):
        assert np.abs(positions[OUTPUT_OF_CANONICAL_INDEX] - arms_swinging(0.3)).max() < 1e-9


@pytest.mark.parametrize("preset", ["raw", "studio"])
def test_nothing_before_the_performer_is_seen(preset):
    unseen = np.full((JOINT_COUNT, 3), np.nan)
    assert run(lambda t: unseen, 2, preset=preset) == [None, None]


def test_relax_pose_moves_towards_the_middle_of_the_ranges():
    human = humanoid()
    middle = human.range_rad.mean(axis=1)

    def distance(weight):
        positions, rotations, _, _ = run(arms_swinging, 30, f"relax_pose={weight}", "look_at=off")[-1]
        q = configuration_of(human, positions[0], matrices(rotations))[7:]
        return np.linalg.norm(q - middle)

    assert distance(0.5) == pytest.approx(0.5 * distance(0), rel=0.05)
    assert distance(1) < 1e-6


def test_hand_states_reach_the_fingers():
    body = BodySolver(performer(), parse_settings("studio"))
    joints = arms_swinging(0.0)
    bends = []
    for probability in (1.0, 0.0):
        seen = frame_set(0.0, joints[None])
        seen = type(seen)(**vars(seen) | {"hands": (HandSeen("left", "shape", probability),)})
        for _ in range(90):
            _, rotations, _, _ = body.pose(fused(joints), seen, DT)
        hand, finger = (matrices(rotations)[OUTPUT_INDEX[n]] for n in ("LeftHand", "LeftHandIndex3"))
        bends.append(np.degrees(np.arccos(np.clip((np.trace(hand.T @ finger) - 1) / 2, -1, 1))))
    assert bends[0] < 5 and bends[1] > 90

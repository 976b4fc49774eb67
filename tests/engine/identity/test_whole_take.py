"""Performers of a whole take: bad recordings lose nobody silently."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.identity.recognised import MOST_PERFORMERS
from studio.engine.identity.whole_take import find_people
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import PARENTS
from tests.engine.walkers import arms_swinging, performer, stage

RATE_HZ = 15.0
HOLDS_S = 2.0
"""How long all hold a T-pose at the beginning."""

CALIBRATION = stage(-35.0, 35.0)


def t_pose():
    """The joints of a T-pose, shape (21, 3)."""
    joints = performer().offsets_m.copy()
    for joint, parent in enumerate(PARENTS):
        joints[joint] += joints[parent] if parent >= 0 else 0.0
    return joints


T_POSE = t_pose()


def recorded(
    places, *, seconds=3.5, sizes=None, bystanders=(), number=lambda who, k: who, seen=None, alone_s=0.0
):
    """Frames of two cameras that see bodies at places on the floor; the first body is alone for some seconds.

    `bystanders` hold no T-pose; `number(who, frame)` is the device's number; `seen(camera, who, time_s)` is whether
    a camera sees a body.
    """
    rng, sizes = np.random.default_rng(3), sizes or [1.0] * len(places)
    frames = {name: [] for name in CALIBRATION.cameras}
    for k in range(round((alone_s + seconds) * RATE_HZ)):
        time_s = k / RATE_HZ
        for index, (name, camera) in enumerate(CALIBRATION.cameras.items()):
            bodies = []
            for who, (x, y) in enumerate(places):
                if (who and time_s < alone_s) or (seen is not None and not seen(index, who, time_s)):
                    continue
                holds = who not in bystanders and time_s - alone_s < HOLDS_S
                joints = sizes[who] * (T_POSE if holds else arms_swinging(time_s + who)) + [x, y, 0.0]
                joints = joints + rng.normal(0.0, 0.004, joints.shape)
                at = transform_points(invert_transform(camera.T_stage_camera), joints)
                bodies.append(CameraFrame(name, k, round(time_s * 1e9), at, np.ones(21), body=number(who, k)))
            if bodies:
                frames[name].append(replace(bodies[0], others=tuple(bodies[1:])))
    return frames


def places_of(people):
    """Average place of each performer's hips [m], from camera a's frames, and the spread."""
    T = CALIBRATION.cameras["a"].T_stage_camera
    hips = [
        transform_points(T, np.array([frame.positions[0] for frame in one.frames["a"]]))
        for one in people.performers
    ]
    return [tuple(np.round(of.mean(axis=0)[:2], 1) + 0.0) for of in hips], max(
        of.std(axis=0).max() for of in hips
    )


TWO = [(-1.0, 0.0), (1.0, 0.0)]


def test_who_holds_no_t_pose_is_a_bystander_and_told():
    people = find_people(recorded([*TWO, (0.0, 1.5)], bystanders=(2,), alone_s=1.0), CALIBRATION)
    assert len(people.performers) == 2 and people.bystanders == 1 and people.left_out == 0


def test_everybody_is_a_performer_if_the_operator_says_so():
    frames = recorded(TWO, seconds=4.0, sizes=[1.0, 0.85], bystanders=(0, 1))
    unknown = replace(CALIBRATION, performer=None)
    assert len(find_people(frames, unknown).performers) == 1
    people = find_people(frames, unknown, everybody=True)
    heights = [one.calibration.performer.height_m for one in people.performers if one.calibration.performer]
    assert people.bystanders == 0 and heights[1] / heights[0] == pytest.approx(0.85, abs=0.02)


def test_numbers_that_change_every_frame_change_nobody():
    people = find_people(recorded(TWO, number=lambda who, k: (7 * k + who) % 50), CALIBRATION)
    found, spread_m = places_of(people)
    assert sorted(found) == TWO and spread_m < 0.05


def test_twins_stay_where_they_are():
    """Their bones are equal; the first one was alone for a while."""
    people = find_people(recorded(TWO, alone_s=1.0), CALIBRATION)
    assert [one.name for one in people.performers] == ["performer_1", "performer_2"]
    assert places_of(people)[0] == TWO
    assert all(one.undecided_s == () for one in people.performers)


def test_a_body_that_splits_into_two_is_one_performer():
    """Example: for a second, a device sees a ghost a hand's width away."""
    ghost = (1.15, 0.1)
    frames = recorded([*TWO, ghost], seen=lambda camera, who, t: who < 2 or (camera == 0 and 2.2 < t < 3.2))
    people = find_people(frames, CALIBRATION)
    assert len(people.performers) == 2 and people.bystanders == 0
    assert sorted(places_of(people)[0]) == TWO


def test_a_camera_that_sees_only_one_is_used_for_that_one():
    people = find_people(recorded(TWO, seen=lambda camera, who, t: camera == 0 or who == 0), CALIBRATION)
    cameras = {one.name: set(one.frames) for one in people.performers}
    assert sorted(map(len, cameras.values())) == [1, 2]


@pytest.mark.parametrize("count", [MOST_PERFORMERS, MOST_PERFORMERS + 1])
def test_the_ninth_performer_is_told_and_left_out(count):
    places = [(0.9 * (k % 3) - 0.9, 1.9 * (k // 3) - 1.9) for k in range(count)]
    people = find_people(recorded(places, seconds=2.2), CALIBRATION)
    assert len(people.performers) == MOST_PERFORMERS
    assert people.left_out == count - MOST_PERFORMERS and people.bystanders == 0

"""Planted clean-up events, each with its time, joint and size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from studio.engine.metrics.cleanup import cleanup_events, events_per_min
from studio.engine.metrics.cleanup.flips import limb_flips
from studio.engine.metrics.cleanup.floor import floor_penetrations
from studio.engine.metrics.cleanup.frozen import frozen_limbs
from studio.engine.metrics.cleanup.overlap import segment_distance_m, self_penetrations
from studio.engine.metrics.cleanup.pops import joint_pops
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.metrics.cleanup.slides import stance_slides, wandering_m
from studio.engine.model.joints import INDEX, JOINT_COUNT

RATE = 120.0
COUNT = 600
TIME = 5.0 + np.arange(COUNT) / RATE

REST = {
    "hips": (0, 0, 0.95), "spine": (0, 0, 1.1), "chest": (0, 0, 1.3), "neck": (0, 0, 1.5), "head": (0, 0, 1.65),
    "shoulder": (0.2, 0, 1.42), "elbow": (0.45, 0.04, 1.2), "wrist": (0.65, -0.2, 1.0), "hand": (0.7, -0.25, 0.93),
    "hip": (0.1, 0, 0.9), "knee": (0.12, -0.05, 0.5), "ankle": (0.12, 0.02, 0.08), "toe": (0.13, -0.13, 0.02),
}  # fmt: skip


def standing(count=COUNT):
    """Canonical joints of a body at rest [m], shape (count, 21, 3): arms away from the trunk, limbs slightly bent."""
    out = np.empty((JOINT_COUNT, 3))
    for name, joint in INDEX.items():
        side, _, part = name.rpartition("_")
        out[joint] = np.array(REST[part]) * [-1.0 if side == "right" else 1.0, 1.0, 1.0]
    return np.repeat(out[None], count, axis=0)


def shown(positions, rotations=None, time=TIME):
    turns = np.tile(np.eye(3), (len(positions), JOINT_COUNT, 1, 1)) if rotations is None else rotations
    return ShownMotion(time, positions, turns, standing(1)[0])


def swaying(time=TIME):
    """The body at rest moved along a cubic of time, in which no detector may find an event."""
    t = (time - time.mean())[:, None, None]
    return standing(len(time)) + (0.3 * t - 0.05 * t**2 + 0.04 * t**3) * np.array([0.6, 0.8, 0.0])


def test_a_clean_motion_has_no_event():
    assert cleanup_events(shown(standing())) == []
    assert cleanup_events(shown(swaying()), swaying()) == []
    assert cleanup_events(shown(swaying())) == []


@settings(max_examples=25, deadline=None)
@given(
    joint=st.sampled_from(["left_wrist", "right_knee", "head", "hips"]),
    frame=st.integers(30, COUNT - 31),
    height_cm=st.floats(5.01, 60.0),
    seed=st.integers(0, 99),
)
def test_a_spike_is_a_pop_of_its_own_height_on_any_cubic(joint, frame, height_cm, seed):
    direction = np.random.default_rng(seed).normal(size=3)
    motion = swaying()
    motion[frame, INDEX[joint]] += height_cm / 100 * direction / np.linalg.norm(direction)
    for reference in (None, swaying()):
        (event,) = joint_pops(shown(motion), reference)
        assert (event.kind, event.joint, event.unit) == ("joint_pop", joint, "cm")
        assert event.size == pytest.approx(height_cm, abs=1e-9)
        assert event.peak_s == TIME[frame]


def test_a_spike_under_5_cm_or_one_that_the_reference_has_is_no_pop():
    motion = swaying()
    motion[200, INDEX["left_wrist"], 1] += 0.0499
    assert joint_pops(shown(motion), None) == []
    motion[200, INDEX["left_wrist"], 1] += 0.3
    late = swaying()
    late[206, INDEX["left_wrist"], 1] += 0.35  # in the reference 50 ms later
    assert len(joint_pops(shown(motion), swaying())) == 1
    assert joint_pops(shown(motion), late) == []


def test_a_step_counts_by_half_its_height():
    for height, expected in ((0.099, 0), (0.102, 1)):
        motion = standing()
        motion[300:, INDEX["right_wrist"], 2] += height
        events = joint_pops(shown(motion), None)
        assert len(events) == expected
        assert all(e.size == pytest.approx(50 * height, rel=0.25) for e in events)


def test_pops_of_one_limb_are_one_event_and_the_hips_carry_everything():
    motion = swaying()
    for name, height in (("left_elbow", 0.1), ("left_wrist", 0.2), ("left_hand", 0.15)):
        motion[200, INDEX[name], 0] += height
    (event,) = joint_pops(shown(motion), None)
    assert event.joint == "left_wrist"
    whole = swaying()
    whole[200] += [0.0, 0.3, 0.0]
    (event,) = joint_pops(shown(whole), None)
    assert event.size == pytest.approx(30.0, abs=1e-9)


@settings(max_examples=15, deadline=None)
@given(angle=st.floats(40.1, 175.0), seed=st.integers(0, 99))
def test_a_turn_off_a_steady_rotation_is_a_pop_of_its_angle(angle, seed):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    steady = Rotation.from_rotvec(np.outer(TIME - TIME[0], axis / np.linalg.norm(axis)))
    turns = np.tile(np.eye(3), (COUNT, JOINT_COUNT, 1, 1))
    turns[:, INDEX["left_elbow"]] = steady.as_matrix()
    other = rng.normal(size=3)
    jolt = Rotation.from_rotvec(np.radians(angle) * other / np.linalg.norm(other)).as_matrix()
    turns[250, INDEX["left_elbow"]] = turns[250, INDEX["left_elbow"]] @ jolt
    (event,) = joint_pops(shown(standing(), turns), standing())
    assert (event.joint, event.unit, event.peak_s) == ("left_elbow", "deg", TIME[250])
    assert event.size == pytest.approx(angle, abs=1e-6)


def test_an_elbow_that_turns_over_is_a_flip():
    motion = standing()
    root, end = motion[0, INDEX["left_shoulder"]], motion[0, INDEX["left_wrist"]]
    line = (end - root) / np.linalg.norm(end - root)
    off = motion[0, INDEX["left_elbow"]] - root
    over = off - 2 * (off - (off @ line) * line)
    motion[300:, INDEX["left_elbow"]] = root + over
    (event,) = limb_flips(shown(motion), standing())
    assert (event.kind, event.joint, event.unit) == ("limb_flip", "left_elbow", "deg")
    assert event.size == pytest.approx(180.0, abs=1e-6)
    assert abs(event.peak_s - TIME[300]) < 0.1
    assert limb_flips(shown(motion), motion) == []  # so in the reference, too


def test_a_limb_that_swings_does_not_flip():
    turn = Rotation.from_euler("x", 10.0 * (TIME - TIME[0])[:, None]).as_matrix()  # 573 degrees per second
    body = standing()
    shoulder = body[:, INDEX["left_shoulder"]]
    for name in ("left_elbow", "left_wrist", "left_hand"):
        body[:, INDEX[name]] = shoulder + (turn @ (body[:, INDEX[name]] - shoulder)[..., None])[..., 0]
    assert limb_flips(shown(body), None) == []


def test_left_and_right_that_are_swapped_are_a_flip():
    motion = standing()
    a, b = INDEX["left_ankle"], INDEX["right_ankle"]
    motion[200:260, [a, b]] = motion[200:260, [b, a]]
    (event,) = limb_flips(shown(motion), standing())
    assert event.detail == "left and right swapped" and event.size == pytest.approx(24.0, abs=1e-9)
    motion = standing()
    motion[200:206, [a, b]] = motion[200:206, [b, a]]  # 50 ms: pops, not a swap
    assert limb_flips(shown(motion), standing()) == []


@pytest.mark.parametrize(("slide_cm", "count"), [(0.9, 0), (1.2, 1), (4.0, 1)])
def test_a_standing_foot_that_slides(slide_cm, count):
    motion = standing()
    ramp = np.clip((TIME - TIME[200]) / 1.0, 0.0, 1.0)[:, None] * np.array([0.6, 0.8, 0.0]) * slide_cm / 100
    for name in ("right_ankle", "right_toe"):
        motion[:, INDEX[name]] += ramp
    events = stance_slides(shown(motion), standing())
    assert len(events) == count
    assert all(e.size == pytest.approx(slide_cm, abs=1e-9) and e.joint.startswith("right") for e in events)
    assert stance_slides(shown(motion), motion) == []  # a performer who slides is followed


def test_wandering_is_horizontal():
    path = np.array([[0.0, 0.0, 0.0], [0.03, 0.04, 9.0]])
    assert wandering_m(path) == pytest.approx([0.0, 0.05], abs=1e-12)


def test_a_foot_in_the_air_does_not_slide():
    motion = standing()
    for name in ("right_ankle", "right_toe"):
        motion[200:400, INDEX[name], 2] += 0.2
        motion[200:400, INDEX[name], 0] += 0.1
    assert [e for e in stance_slides(shown(motion), motion)] == []


@settings(max_examples=20, deadline=None)
@given(depth_cm=st.floats(1.01, 20.0), first=st.integers(50, 200), frames=st.integers(1, 300))
def test_what_is_under_the_floor_is_told_by_its_depth(depth_cm, first, frames):
    motion = standing()
    motion[first : first + frames, INDEX["left_toe"], 2] = 0.02 - depth_cm / 100
    (event,) = floor_penetrations(shown(motion))
    assert (event.joint, event.start_s, event.end_s) == ("left_toe", TIME[first], TIME[first + frames - 1])
    assert event.size == pytest.approx(depth_cm, abs=1e-9)


def test_a_heel_that_tips_goes_under_the_floor_with_its_sole():
    """The ankle stays at 8 cm above a foot that tips by 30 degrees: the heel under it rises, no penetration."""
    turns = np.tile(np.eye(3), (COUNT, JOINT_COUNT, 1, 1))
    turns[:, INDEX["left_ankle"]] = Rotation.from_euler("x", 30, degrees=True).as_matrix()
    assert floor_penetrations(shown(standing(), turns)) == []
    motion = standing()
    motion[:, INDEX["left_wrist"], 2] = -0.005
    assert floor_penetrations(shown(motion)) == []
    motion[:, INDEX["left_wrist"], 2] = -0.03
    assert [e.joint for e in floor_penetrations(shown(motion))] == ["left_wrist"]


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**16))
def test_the_distance_of_segments_is_the_least_of_all_pairs(seed):
    a0, a1, b0, b1 = np.random.default_rng(seed).normal(size=(4, 1, 3))
    s, t = np.meshgrid(np.linspace(0, 1, 101), np.linspace(0, 1, 101))
    pairs = (a0 + s[..., None] * (a1 - a0)) - (b0 + t[..., None] * (b1 - b0))
    least = np.linalg.norm(pairs, axis=-1).min()
    found = segment_distance_m(a0, a1, b0, b1)[0]
    assert found <= least + 1e-12 and found > least - 0.02
    assert segment_distance_m(b0, b1, a0, a1)[0] == pytest.approx(found, abs=1e-9)


def test_segments_of_known_distance():
    x, z, o = np.array([[1.0, 0, 0]]), np.array([[0, 0, 2.5]]), np.zeros((1, 3))
    assert segment_distance_m(o, x, o + z, x + z)[0] == pytest.approx(2.5, abs=1e-12)  # parallel
    assert segment_distance_m(o, x, 3 * x, 4 * x)[0] == pytest.approx(2.0, abs=1e-12)  # in one line
    assert segment_distance_m(o, x, 0.5 * x, 0.5 * x + z)[0] == pytest.approx(0.0, abs=1e-12)


def test_a_forearm_in_the_trunk():
    motion = standing()
    arm = {"elbow": (0.15, -0.02, 1.15), "wrist": (-0.05, -0.02, 1.15), "hand": (-0.12, -0.02, 1.15)}
    for name, place in arm.items():
        motion[300:420, INDEX[f"left_{name}"]] = place
    (event,) = [e for e in self_penetrations(shown(motion), None) if "trunk" in e.detail]
    height = REST["head"][2] / 0.936
    assert event.detail == "left forearm in trunk" and (event.start_s, event.end_s) == (TIME[300], TIME[419])
    assert event.size == pytest.approx(100 * ((0.058 + 0.020) * height - 0.02), abs=1e-9)
    assert (
        self_penetrations(shown(motion), motion) == []
    )  # where the reference is as deep, there is nothing to correct


@pytest.mark.parametrize(("seconds", "count"), [(0.25, 0), (0.5, 1), (2.0, 1)])
def test_an_arm_that_stops(seconds, count):
    """The reference's wrist moves at 50 cm/s or more; the solve's stays in place for a while."""
    moving = standing()
    swing = 0.25 * np.sin(2 * np.pi * 1.0 * (TIME - TIME[0]))[:, None] * np.array([0.0, 1.0, 0.0])
    for name in ("left_elbow", "left_wrist", "left_hand"):
        moving[:, INDEX[name]] += swing
    stopped = moving.copy()
    first, last = 120, 120 + round(seconds * RATE)
    for name in ("left_elbow", "left_wrist", "left_hand"):
        stopped[first : last + 1, INDEX[name]] = moving[first, INDEX[name]]
    events = frozen_limbs(shown(stopped), moving)
    assert [(e.joint, e.unit) for e in events] == [("left_wrist", "s")] * count
    assert all(e.size == pytest.approx(seconds, abs=0.1) for e in events)
    assert frozen_limbs(shown(moving), moving) == []


def test_a_turning_body_carries_a_frozen_arm():
    """The arm is frozen on a trunk that turns: it moves through the room."""
    turn = Rotation.from_euler("z", 2.0 * (TIME - TIME[0])[:, None]).as_matrix()
    reference = (turn[:, None] @ standing()[..., None])[..., 0]
    stopped = reference.copy()
    swing = 0.25 * np.sin(2 * np.pi * 1.0 * (TIME - TIME[0]))[:, None] * np.array([0.0, 0.0, 1.0])
    reference[:, INDEX["left_wrist"]] += swing
    assert [e.joint for e in frozen_limbs(shown(stopped), reference)] == ["left_wrist"]


def test_events_are_sorted_counted_per_minute_and_json():
    motion = swaying()
    motion[400, INDEX["left_wrist"], 1] += 0.3
    motion[100:200, INDEX["right_toe"], 2] -= 0.03
    events = cleanup_events(shown(motion), swaying())
    assert [e.kind for e in events] == ["floor_penetration", "joint_pop"]
    assert events_per_min(events, shown(motion)) == pytest.approx(2 * 60 / (TIME[-1] - TIME[0]))
    assert events[0].to_json() == {
        "kind": "floor_penetration", "joint": "right_toe", "start_s": 5.8333, "end_s": 6.6583, "peak_s": 5.8333,
        "size": 3.0, "unit": "cm", "detail": "",
    }  # fmt: skip

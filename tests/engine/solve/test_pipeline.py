"""The pipeline from camera frames to poses: deterministic, human for any input, accurate on known motion."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.base.errors import CalibrationError, SettingsError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, ClockModel, HandSeen
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    MEASURED_JOINTS,
    MIRROR,
    OUTPUT_INDEX,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENTS,
)
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.pipeline import Pipeline
from studio.engine.solve.timing.schedule import Schedule
from tests.engine.walkers import SECOND, arms_swinging, camera_frame, performer, recorded, stage
from tests.refused import refused

TWO = (-35.0, 35.0)
MEASURED = [INDEX[name] for name in MEASURED_JOINTS]


def run(calibration, frames, *assignments, preset="studio", pipeline=None, hz=60):
    """Steps' results of all frames, in the way of a replay."""
    settings = parse_settings(preset, (f"output_hz={hz}", *assignments))
    pipeline = pipeline or Pipeline(calibration, settings)
    schedule, results = Schedule(hz), []
    for frame in frames:
        pipeline.add_frame(frame)
        for stage_ns in schedule.due(pipeline.newest_stage_ns()):
            results.append(pipeline.step(stage_ns))
    return [r for r in results if r is not None]


def assert_human(results, calibration=None):
    """Check for finite values, constant bone lengths, unit rotations, and a place on the stage."""
    rest = Skeleton.of((calibration or stage(0.0)).performer)
    lengths = np.linalg.norm(rest.offsets_m, axis=1)[1:]
    assert results
    for r in results:
        p = r.positions_m
        assert np.isfinite(p).all() and np.isfinite(r.rotations_wxyz).all()
        assert np.abs(np.linalg.norm(p[1:] - p[OUTPUT_PARENTS[1:]], axis=1) - lengths).max() < 1e-9
        assert np.abs(np.linalg.norm(r.rotations_wxyz, axis=1) - 1).max() < 1e-9
        assert np.abs(p).max() < 20
        assert ((r.confidence >= 0) & (r.confidence <= 1)).all()


def errors_m(results, joints_at):
    """Mean error per frame over the measured joints [m]."""
    return np.array([
        np.linalg.norm(
            r.positions_m[OUTPUT_OF_CANONICAL_INDEX][MEASURED]
            - joints_at(r.frame_set.stage_time_ns / SECOND)[MEASURED],
            axis=1,
        ).mean()
        for r in results
    ])  # fmt: skip


def test_the_same_calls_give_the_same_bits():
    calibration = stage(*TWO)
    frames = list(recorded(calibration, arms_swinging, 1.5, noise_m=0.02, seed=3))
    for extra in ((), ("smoothing=one_euro:after", "displacement_limit=before", "look_at=hands")):
        a, b = run(calibration, frames, *extra), run(calibration, frames, *extra)
        assert len(a) == len(b) > 80
        for x, y in zip(a, b, strict=True):
            for name in ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm"):
                assert getattr(x, name).tobytes() == getattr(y, name).tobytes()


def test_ideal_cameras_give_the_performer():
    calibration = stage(*TWO)
    results = run(calibration, recorded(calibration, arms_swinging, 2.0))
    assert_human(results)
    assert errors_m(results[30:], arms_swinging).mean() < 0.015


@pytest.mark.parametrize("preset", ["raw", "thesis", "studio"])
def test_every_preset_follows_noisy_cameras(preset):
    calibration = stage(*TWO)
    results = run(calibration, recorded(calibration, arms_swinging, 1.5, noise_m=0.015), preset=preset)
    assert errors_m(results[20:], arms_swinging).mean() < 0.06
    if preset != "raw":
        assert_human(results)


OTHERS = [
    "fusion=mean", "ik=combined_skeleton", "human_limits=off", "flexibility=0", "flexibility=2", "relax_pose=0.3",
    "bone_length_limit=2", "displacement_limit=before", "displacement_limit=after", "smoothing=holt:before",
    "smoothing=holt:after", "smoothing=one_euro:before", "smoothing=one_euro:after", "look_at=hands",
    "look_at=near", "look_at=point", "look_at=measured", "look_at=off", "hands=circles", "hands=off",
    "floor_contact=off", "effectors.left_wrist.pull=0.2", "output_hz=30", "output_hz=120", "cameras=b",
]  # fmt: skip


@pytest.mark.parametrize("assignment", OTHERS)
def test_every_switch_gives_a_human_through_gaps_and_spikes(assignment):
    calibration, rng = stage(*TWO), np.random.default_rng(1)
    hz = int(assignment.split("=")[1]) if assignment.startswith("output_hz") else 30
    frames = []
    for frame in recorded(calibration, arms_swinging, 1.6, noise_m=0.01):
        positions = frame.positions.copy()
        positions[rng.random(JOINT_COUNT) < 0.1] = np.nan
        positions[rng.random(JOINT_COUNT) < 0.05] += 0.5
        if 1.7 < frame.device_time_ns / SECOND < 1.9:
            positions[:] = np.nan
        hands = (HandSeen("left", "shape", rng.random()), HandSeen("right", "circles", rng.random()))
        frames.append(replace(frame, positions=positions, hands=hands))
    results = run(calibration, frames, assignment, hz=hz)
    assert len(results) > 1.3 * hz
    assert_human(results)


def test_a_gap_of_ten_seconds():
    calibration = stage(*TWO)

    def walked_away(time_s):
        return arms_swinging(time_s) + np.array([1.2, 0.6, 0.0])

    frames = [
        *recorded(calibration, arms_swinging, 1.0),
        *recorded(calibration, walked_away, 1.0, start_s=12.0),
    ]
    results = run(calibration, frames)
    assert_human(results)
    assert errors_m(results[-20:], walked_away).mean() < 0.03


def test_a_long_gap_between_steps_with_nothing_seen():
    calibration = stage(*TWO)
    pipeline = Pipeline(calibration, parse_settings("studio"))
    before = run(calibration, recorded(calibration, arms_swinging, 1.0), pipeline=pipeline)
    for time_s in (12.0, 12.1, 50.0, 5000.0):
        result = pipeline.step(round(time_s * SECOND))
        assert_human([result])
        assert np.linalg.norm(result.positions_m[0] - before[-1].positions_m[0]) < 0.5


AFTER = ("smoothing=one_euro:after", "displacement_limit=after")
BEFORE = ("smoothing=holt:before", "displacement_limit=before")
BACK_S = (0.001, 0.2, 10.0, 1e6)


@pytest.mark.parametrize(
    ("extra", "back_s"),
    [
        *(((), back_s) for back_s in BACK_S),
        (AFTER, 0.2),
        (BEFORE, 10.0),
        *(pytest.param(AFTER, back_s, marks=pytest.mark.long) for back_s in BACK_S if back_s != 0.2),
        *(pytest.param(BEFORE, back_s, marks=pytest.mark.long) for back_s in BACK_S if back_s != 10.0),
    ],
)
def test_time_going_back(extra, back_s):
    calibration = stage(*TWO)
    start_s = 1.0 + back_s
    pipeline = Pipeline(calibration, parse_settings("studio", extra))
    hand = (HandSeen("left", "shape", 0.9),)
    for first, seconds in ((start_s, 0.5), (start_s - back_s, 1.0)):
        results = []
        for frame in recorded(calibration, lambda t: arms_swinging(0.3), seconds, start_s=first):
            pipeline.add_frame(replace(frame, hands=hand))
            if frame.camera == "b":
                results.append(pipeline.step(frame.device_time_ns))
        assert all(r is not None for r in results)
        assert_human(results)
        hands = [r.rotations_wxyz[OUTPUT_INDEX["LeftHandIndex1"]] for r in results[-2:]]
        assert np.abs(hands[0] - hands[1]).max() < 0.05
    assert errors_m(results[-5:], lambda t: arms_swinging(0.3)).mean() < 0.03


def test_a_camera_that_vanishes_and_comes_back():
    calibration = stage(*TWO)
    frames = [
        f for f in recorded(calibration, arms_swinging, 4.0, noise_m=0.005)
        if f.camera == "a" or not 2.0 < f.device_time_ns / SECOND < 3.5
    ]  # fmt: skip
    results = run(calibration, frames)
    assert_human(results)
    assert errors_m(results[30:], arms_swinging).max() < 0.05
    times = np.array([r.frame_set.stage_time_ns for r in results])
    assert np.diff(times).max() < 1.1 * SECOND / 60, "no output frame is left out"
    used = np.array([r.fused.used.any(axis=1) for r in results])
    assert used[:, 0].all() and used[-10:, 1].all() and not used[120, 1]


def test_another_persons_skeleton_in_one_camera_does_not_take_over():
    calibration = stage(*TWO)

    def frames():
        for frame in recorded(calibration, arms_swinging, 3.0, noise_m=0.005):
            time_s = frame.device_time_ns / SECOND
            if frame.camera == "b" and time_s > 2.0:
                frame = camera_frame(
                    calibration, "b", time_s, arms_swinging(time_s) + np.array([1.8, 1.5, 0.0])
                )
            yield frame

    results = run(calibration, frames())
    assert_human(results)
    assert errors_m(results[30:], arms_swinging).max() < 0.05


def test_the_performer_leaves_and_comes_back_elsewhere():
    calibration = stage(*TWO)

    def back(time_s):
        return arms_swinging(time_s) + np.array([-0.9, 0.4, 0.0])

    nobody = np.full((JOINT_COUNT, 3), np.nan)
    frames = [
        *recorded(calibration, arms_swinging, 1.0),
        *recorded(calibration, lambda t: nobody, 2.0, start_s=2.0),
        *recorded(calibration, back, 1.0, start_s=4.0),
    ]
    results = run(calibration, frames)
    assert_human(results)
    gone = [r for r in results if 3.0 < r.frame_set.stage_time_ns / SECOND < 3.9]
    assert gone and all((r.confidence < 0.05).all() for r in gone)
    assert errors_m(results[-15:], back).mean() < 0.03


def test_hostile_numbers_never_reach_the_pose():
    calibration, rng = stage(*TWO), np.random.default_rng(7)
    evil = [np.inf, -np.inf, np.nan, 3e38, -3e38, 1e20, 1e6, 1e-40, 0.0]
    frames = []
    for frame in recorded(calibration, arms_swinging, 2.0):
        positions, confidence = frame.positions.copy(), frame.confidence.copy()
        if 1.5 < frame.device_time_ns / SECOND < 2.5:
            where = rng.random(positions.shape) < rng.choice([0.02, 0.5, 1.0])
            positions[where] = rng.choice(evil, where.sum())
            confidence = rng.uniform(0, 1, JOINT_COUNT)
        head = tuple(rng.choice([*evil, 1.0], 4))
        frames.append(replace(frame, positions=positions, confidence=confidence, head_wxyz=head))
    for extra in (
        ("look_at=measured",),
        ("fusion=mean",),
        ("ik=combined_skeleton", "bone_length_limit=2", "smoothing=holt:before"),
    ):
        results = run(calibration, frames, *extra)
        assert len(results) > 90
        assert_human(results)
        assert errors_m(results[-10:], arms_swinging).mean() < 0.04


def test_a_camera_at_the_stages_origin_that_misses_joints():
    calibration = stage(0.0)
    camera = replace(calibration.cameras["a"], T_stage_camera=np.eye(4))
    calibration = Calibration("a", {"a": camera}, performer())

    def standing(time_s):  # camera axes are the stage's here: the performer is wherever the camera looks
        return arms_swinging(time_s) + np.array([0, 0, 2.0])

    frames = []
    for frame in recorded(calibration, standing, 0.5):
        positions = frame.positions.copy()
        positions[INDEX["left_hand"]] = np.nan
        positions[INDEX["right_hand"]] = 0.0
        frames.append(replace(frame, positions=positions))
    assert_human(run(calibration, frames, "floor_contact=off"))


def test_nothing_comes_before_the_performer_is_seen():
    calibration = stage(*TWO)
    pipeline = Pipeline(calibration, parse_settings("studio"))
    assert pipeline.newest_stage_ns() == {}
    assert pipeline.step(SECOND) is None
    pipeline.add_frame(camera_frame(calibration, "a", 1.0, np.full((JOINT_COUNT, 3), np.nan)))
    assert pipeline.step(SECOND) is None


def test_frames_of_unknown_cameras_are_ignored():
    calibration = stage(0.0)
    pipeline = Pipeline(calibration, parse_settings("studio"))
    stray = CameraFrame("z", 0, SECOND, np.zeros((JOINT_COUNT, 3)), np.ones(JOINT_COUNT))
    pipeline.add_frame(stray)
    pipeline.set_clock("z", ClockModel(offset_ns=5))
    assert pipeline.newest_stage_ns() == {}


def test_it_needs_a_performer_and_known_cameras():
    with refused(CalibrationError, "calibration.no_proportions"):
        Pipeline(replace(stage(0.0), performer=None), parse_settings("studio"))
    with refused(SettingsError, "settings.unknown_cameras", names="camera_9"):
        Pipeline(stage(0.0), parse_settings("studio", ["cameras=camera_9"]))


def test_a_clock_set_while_running_moves_the_frames():
    calibration = stage(*TWO)
    pipeline = Pipeline(calibration, parse_settings("studio"))
    pipeline.set_clock("b", ClockModel(offset_ns=-2 * SECOND))
    for frame in recorded(calibration, arms_swinging, 0.5):
        late = 2 * SECOND if frame.camera == "b" else 0
        pipeline.add_frame(replace(frame, device_time_ns=frame.device_time_ns + late))
    newest = pipeline.newest_stage_ns()
    assert newest["a"] == newest["b"]
    pipeline.set_settings(parse_settings("thesis"))
    pipeline.add_frame(camera_frame(calibration, "b", 5.0, arms_swinging(5.0)))
    assert pipeline.newest_stage_ns() == {"b": 3 * SECOND}, "other settings keep the clock"


def test_other_settings_and_another_calibration_start_anew():
    calibration = stage(*TWO)
    pipeline = Pipeline(calibration, parse_settings("studio"))
    run(calibration, recorded(calibration, arms_swinging, 0.5), pipeline=pipeline)
    smaller = stage(*TWO, height_m=1.5)
    pipeline.set_calibration(smaller)
    assert pipeline.step(2 * SECOND) is None
    results = run(
        smaller,
        recorded(smaller, lambda t: arms_swinging(t) * 1.5 / 1.78, 0.5, start_s=3.0),
        pipeline=pipeline,
    )
    assert_human(results, smaller)


def test_the_depth_bias_is_taken_back():
    bias = 0.03
    true, biased = stage(0.0), stage(0.0, bias_m=bias)

    def frames():
        for frame in recorded(true, arms_swinging, 1.0):
            distance = np.linalg.norm(frame.positions, axis=1, keepdims=True)
            yield replace(frame, positions=frame.positions * (1 - bias / distance))

    with_it = errors_m(run(biased, frames())[20:], arms_swinging).mean()
    without = errors_m(run(true, frames())[20:], arms_swinging).mean()
    assert with_it < 0.015 < 0.025 < without


@pytest.fixture(scope="module")
def demo_errors():
    """Mean error [m] of presets raw and studio on a part of the authored motion, two noisy cameras."""
    motion, calibration = demo_motion(), stage(*TWO)
    out = {}
    for preset in ("raw", "studio"):
        frames = recorded(calibration, motion.at, 8.0, noise_m=0.03, seed=5, start_s=3.0)
        results = run(calibration, frames, preset=preset)
        if preset == "studio":
            assert_human(results)
        out[preset] = errors_m(results[30:], motion.at).mean()
    return out


def test_studio_is_accurate_on_authored_motion_and_better_than_raw(demo_errors):
    assert demo_errors["studio"] < 0.035, demo_errors
    assert demo_errors["studio"] < demo_errors["raw"], demo_errors


def test_confidence_and_uncertainty_come_by_output_joint():
    calibration = stage(*TWO)

    def hidden(time_s):
        joints = arms_swinging(time_s).copy()
        joints[[INDEX[f"left_{n}"] for n in ("elbow", "wrist", "hand")]] = np.nan
        return joints

    last = run(calibration, recorded(calibration, hidden, 1.0))[-1]
    for name in ("LeftForeArm", "LeftHand", "LeftHandIndex3"):
        assert last.confidence[OUTPUT_INDEX[name]] == 0 and last.uncertainty_mm[OUTPUT_INDEX[name]] > 250
    for name in ("RightHand", "RightHandIndex1", "Hips", "Spine1"):
        assert last.confidence[OUTPUT_INDEX[name]] > 0.8
        assert 0 < last.uncertainty_mm[OUTPUT_INDEX[name]] < 150
    assert len(CANONICAL) == JOINT_COUNT == last.fused.positions.shape[0]


@pytest.mark.parametrize("preset", ["thesis", "studio", "finish"])
def test_a_body_that_began_with_left_for_right_turns_round(preset):
    """All cameras first take the back for the front, without feet that would show it; then they see it right."""
    calibration = stage(*TWO)
    frames = []
    for frame in recorded(calibration, arms_swinging, 3.0, noise_m=0.01):
        if frame.device_time_ns < 1.4 * SECOND:  # of 1.0 to 4.0
            positions = frame.positions[MIRROR].copy()
            positions[[INDEX["left_toe"], INDEX["right_toe"]]] = np.nan
            frame = replace(frame, positions=positions)
        frames.append(frame)
    results = run(calibration, frames, preset=preset)
    assert errors_m(results, arms_swinging)[:20].mean() > 0.15
    assert errors_m(results, arms_swinging)[-60:].mean() < 0.05

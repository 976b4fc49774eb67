"""Fingers that follow simulated hands: the bar of the hands."""

import numpy as np
import pytest

from studio.engine.animation.motion.authored import stage_motion
from studio.engine.model.joints import INDEX
from studio.simulator.landmarks.fingers import SimulatedHands
from studio.simulator.landmarks.hand_tracker import LEAST_PIXELS, HandTracker
from tests.simulator.finger_figures import BAR_MM, LIVE_BAR_MM, SeenStage, figures, rig, seen_stage


@pytest.fixture(scope="module")
def stage() -> SeenStage:
    return seen_stage(6.0, seed=11)


def test_hands_are_human() -> None:
    motion = stage_motion()
    hands = SimulatedHands(motion.offsets_m, 3)
    points = np.array([hands.points(motion.at(t), t) for t in np.arange(4.0, 60.0, 0.5)])
    bones = np.linalg.norm(np.diff(points[:, :, 1:].reshape(-1, 2, 5, 4, 3), axis=3), axis=-1)
    assert np.ptp(bones, axis=0).max() < 1e-9 and 0.012 < bones.min() < bones.max() < 0.07
    assert 0.16 < hands.length_m < 0.21
    reach = np.linalg.norm(points[:, :, 12] - points[:, :, 0], axis=-1)  # wrist to the middle finger's tip
    assert reach.min() < 0.6 * hands.length_m and reach.max() > 0.95 * hands.length_m
    assert np.array_equal(points[3], SimulatedHands(motion.offsets_m, 3).points(motion.at(5.5), 5.5))


def test_only_large_hands_are_seen_and_not_always(stage: SeenStage) -> None:
    for k, (camera, seen) in enumerate(zip(rig(), stage.seen, strict=True)):
        tracker = HandTracker(camera.T_stage_camera, seen.lens, stage.hands, seed=11, camera=k)
        found = 0
        for time_s, picture in zip(seen.taken_s.tolist(), seen.pictures, strict=True):
            joints = stage.motion.at(time_s)
            for side, name in enumerate(("left_wrist", "right_wrist")):
                there = picture is not None and picture.hand(side) is not None
                found += there
                sizes = [tracker.hand_pixels(joints[INDEX[f"{one}_wrist"]]) for one in ("left", "right")]
                assert not there or max(sizes) >= LEAST_PIXELS, name
        assert 0.2 < found / (2 * len(seen.pictures)) < 0.85


@pytest.mark.parametrize(("preset", "most_mm"), [("studio", LIVE_BAR_MM), ("finish", BAR_MM)])
def test_finger_joints_are_within_the_bar(stage: SeenStage, preset: str, most_mm: float) -> None:
    errors = figures(stage, preset)
    assert np.isfinite(errors).sum() > 200
    assert np.nanmean(errors) < most_mm
    if preset == "studio":
        assert np.nanmean(figures(stage, preset, ["fingers=off"])) > 2.0 * BAR_MM


@pytest.mark.long
@pytest.mark.parametrize(("preset", "most_mm"), [("studio", LIVE_BAR_MM), ("finish", BAR_MM)])
def test_finger_joints_are_within_the_bar_for_other_hands(preset: str, most_mm: float) -> None:
    errors = [figures(seen_stage(30.0, seed), preset) for seed in range(21, 27)]
    assert np.mean([np.nanmean(one) for one in errors]) < most_mm

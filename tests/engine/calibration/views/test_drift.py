"""Clocks of ordinary cameras over long takes: phones and webcams drift by tens of ppm, and some jump."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from studio.engine.base.sentences import codes_of
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.views.drift import follow_views
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import JOINT_COUNT
from tests.engine.calibration.views.synthetic import HEIGHT_M, camera_at, view_of
from tests.engine.calibration.views.test_pictures import EPOCH_NS, frames_of

WALK_S = 15.0
UNTIL_S = EPOCH_NS * 1e-9 + WALK_S
LATER_S = (0.0, 60.0, 120.0, 200.0, 400.0, 580.0)
ANGLES_DEG = (0.0, 85.0, 180.0)
LATE_S = 0.1

Frames = dict[str, list[CameraFrame]]


def clock_s(camera: int, ppm: float, time_s: float) -> float:
    """Reading of a camera's clock at a time: each clock is later and faster than the one before it."""
    return (time_s - LATE_S * camera) * (1.0 + ppm * 1e-6 * camera)


def long_take(ppm: float, cameras: int, *, jump_s: float = 0.0) -> Frames:
    """A walk, and later ones, each with its own errors; the second camera's clock jumps at 120 s."""
    frames: Frames = {}
    for c in range(cameras):
        name, mine = f"c{c}", []
        for n, later_s in enumerate(LATER_S):
            view = view_of(
                name, camera_at(ANGLES_DEG[c]), seed=10 * n + c, seconds=WALK_S, ahead_s=LATE_S * c
            )
            for frame in frames_of(view, 0):
                true_s = later_s + frame.device_time_ns * 1e-9 + LATE_S * c
                shown_s = clock_s(c, ppm, true_s) + (jump_s if c == 1 and later_s >= 120.0 else 0.0)
                mine.append(
                    replace(frame, sequence=len(mine), device_time_ns=EPOCH_NS + round(shown_s * 1e9))
                )
        frames[name] = mine
    return frames


def errors_ms(calibration: Calibration, camera: int, ppm: float, *times_s: float) -> list[float]:
    clock = calibration.cameras[f"c{camera}"].clock
    shown = [EPOCH_NS + round(clock_s(camera, ppm, t) * 1e9) for t in times_s]
    return [abs((clock.stage_ns(s) - EPOCH_NS) * 1e-6 - 1e3 * t) for s, t in zip(shown, times_s, strict=True)]


@cache
def drifting(ppm: float, cameras: int) -> tuple[Frames, Calibration]:
    """A long take, and the calibration of its walk."""
    frames = long_take(ppm, cameras)
    return frames, calibrate(frames, until_s=UNTIL_S, height_m=HEIGHT_M)


@pytest.mark.parametrize(
    ("ppm", "cameras"),
    [
        (-200.0, 2),
        pytest.param(50.0, 2, marks=pytest.mark.long),
        pytest.param(50.0, 3, marks=pytest.mark.long),
    ],
)
def test_drift_is_that_of_the_whole_take(ppm: float, cameras: int) -> None:
    frames, found = drifting(ppm, cameras)
    followed = follow_views(found, frames, UNTIL_S)
    for camera in range(1, cameras):
        assert max(errors_ms(found, camera, ppm, 590.0)) > 20.0
        assert max(errors_ms(followed, camera, ppm, 1.0, 15.0, 300.0, 590.0)) < 5.0
        assert abs(followed.cameras[f"c{camera}"].clock.drift_ppm + ppm * camera) < 8.0
    assert followed.cameras["c0"] == found.cameras["c0"] and followed.performer is found.performer


def test_a_clock_that_jumped_is_told_and_left_as_it_was() -> None:
    frames = long_take(20.0, 2, jump_s=0.25)
    found = calibrate(frames, until_s=UNTIL_S, height_m=HEIGHT_M)
    camera = follow_views(found, frames, UNTIL_S).cameras["c1"]
    assert camera.clock == found.cameras["c1"].clock and camera.verdict == "usable"
    said = codes_of(camera.reasons)[-1]
    assert said["code"] == "views.clock_jumped"
    assert said["values"]["ms"] == pytest.approx(250.0, abs=15.0)
    assert 75.0 < said["values"]["s"] < 135.0


def test_what_tells_nothing_changes_nothing() -> None:
    """A short take, a camera whose performer has left, a refused camera, and a single one."""
    frames, found = drifting(-200.0, 2)
    short = {name: mine[:450] for name, mine in frames.items()}
    assert follow_views(found, short, UNTIL_S) is found
    nobody = np.full((JOINT_COUNT, 2), np.nan)
    gone = {
        name: [
            frame
            if frame.picture is None or k < 450
            else replace(frame, picture=replace(frame.picture, pixels=nobody))
            for k, frame in enumerate(mine)
        ]
        for name, mine in frames.items()
    }
    assert follow_views(found, gone, UNTIL_S).cameras == found.cameras
    refused = found.cameras | {"c1": replace(found.cameras["c1"], verdict="refused")}
    assert follow_views(replace(found, cameras=refused), frames, UNTIL_S).cameras == refused
    assert follow_views(found, frames | {"c1": []}, UNTIL_S) is found

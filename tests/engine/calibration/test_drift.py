"""Clocks of long takes: the walk alone gives the drift with errors of some tens of ppm; the rest improves it."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.cameras.drift import follow_clocks
from tests.engine.calibration.scoring import clock_error_ms
from tests.engine.calibration.test_seeds import walk

WALK_S = 33.0


def long_take(seed, *laters_s):
    """A walk, and copies of it that are later by some seconds; and the true clock of `camera_1`."""
    frames, _, clocks = walk(seed, 2)
    for name, some in frames.items():
        drift = clocks[name].drift_ppm * 1e-6
        frames[name] = some + [
            replace(frame, device_time_ns=frame.device_time_ns + round(later_s * (1 + drift) * 1e9))
            for later_s in laters_s
            for frame in some
        ]
    return frames, clocks["camera_1"]


def errors_ms(calibration, clock, *times_s):
    drift = clock.drift_ppm * 1e-6
    return [clock_error_ms(calibration, "camera_1", at_s, clock.offset_s, drift) for at_s in times_s]


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2))])
def test_drift_is_that_of_the_whole_take(seed):
    frames, clock = long_take(seed, 60.0, 200.0, 600.0)
    found = calibrate(frames, until_s=WALK_S)
    followed = follow_clocks(found, frames, WALK_S)
    assert max(errors_ms(followed, clock, 1.0, 33.0, 300.0, 630.0)) < 3.0
    assert abs(followed.cameras["camera_1"].clock.drift_ppm + clock.drift_ppm) < 1.0
    assert (
        replace(followed, cameras=found.cameras) == found
        and followed.cameras["camera_0"] == found.cameras["camera_0"]
    )


def test_a_short_take_keeps_its_clocks():
    frames, _ = long_take(0)
    found = calibrate(frames, until_s=WALK_S)
    assert follow_clocks(found, frames, WALK_S) is found
    assert follow_clocks(found, frames, None) is found


def test_windows_that_tell_nothing_change_nothing():
    """Once the performer or the camera is gone, the clock stays as it was."""
    frames, _ = long_take(0, 60.0)
    found = calibrate(frames, until_s=WALK_S)
    gone = np.full((21, 3), np.nan)
    frames["camera_1"] = [
        frame if index < 40 else replace(frame, positions=gone)
        for index, frame in enumerate(frames["camera_1"])
    ]
    assert follow_clocks(found, frames, WALK_S).cameras == found.cameras
    frames["camera_1"] = frames["camera_1"][:1]
    assert follow_clocks(found, frames, WALK_S).cameras == found.cameras

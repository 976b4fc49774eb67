"""Landmarks of a rolling shutter are moved to the time of their stamp."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import CalibrationError
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.solve.timing.shutter import RollingShutter

READOUT_S, STEP_S, HEIGHT = 0.025, 1.0 / 30.0, 1000
SPEED = np.array([600.0, -150.0])
UNSEEN = np.full((JOINT_COUNT, 3), np.nan)
AT_FIRST = np.column_stack([np.full(JOINT_COUNT, 300.0), np.linspace(60.0, 940.0, JOINT_COUNT)])


def frame(k: int, pixels: np.ndarray, hands: np.ndarray | None = None) -> CameraFrame:
    picture = PictureJoints(800, HEIGHT, pixels, UNSEEN, hands)
    return CameraFrame("a", k, round(k * STEP_S * 1e9), UNSEEN, np.ones(JOINT_COUNT), picture=picture)


def read(time_s: float) -> np.ndarray:
    """Landmarks that move evenly, at the rows' times of reading: t = time + readout * (row / height - 1 / 2)."""
    still = AT_FIRST + SPEED * time_s
    late_s = READOUT_S * ((still[:, 1] + 0.5) / HEIGHT - 0.5) / (1.0 - READOUT_S * SPEED[1] / HEIGHT)
    return still + SPEED * late_s[:, None]


def settled(shutter: RollingShutter, one: CameraFrame) -> np.ndarray:
    picture = shutter.settled(one)
    assert picture is not None
    return picture.pixels


def test_even_motion_is_brought_to_the_stamp() -> None:
    shutter = RollingShutter(READOUT_S)
    first = frame(0, read(0.0))
    assert shutter.settled(first) is first.picture
    for k in (1, 2, 3):
        off = read(k * STEP_S) - (AT_FIRST + SPEED * k * STEP_S)
        assert np.abs(off).max() > 6.0
        found = settled(shutter, frame(k, read(k * STEP_S)))
        np.testing.assert_allclose(found, AT_FIRST + SPEED * k * STEP_S, atol=0.1)


def test_hands_are_moved_too_and_what_is_unseen_stays_so() -> None:
    shutter = RollingShutter(READOUT_S)
    hands = np.full((2, 21, 2), np.nan)
    hands[0] = [400.0, 900.0]
    shutter.settled(frame(0, read(0.0), hands))
    pixels = read(STEP_S)
    pixels[4] = np.nan
    picture = shutter.settled(frame(1, pixels, hands + SPEED * STEP_S))
    assert picture is not None and picture.hands is not None
    assert np.isnan(picture.pixels[4]).all() and np.isnan(picture.hands[1]).all()
    row = 900.0 + SPEED[1] * STEP_S
    late_s = READOUT_S * ((row + 0.5) / HEIGHT - 0.5)
    np.testing.assert_allclose(picture.hands[0, 3], np.array([400.0, 900.0]) + SPEED * (STEP_S - late_s))


def test_what_tells_no_speed_is_left_as_it_is() -> None:
    """A gap, a picture of another size, a clock that went back, an exchange of left and right, a global shutter."""
    pixels = read(STEP_S)
    for before in (
        frame(-9, read(0.0)),
        frame(3, read(0.0)),
        replace(frame(0, read(0.0)), picture=PictureJoints(400, 500, read(0.0) / 2, UNSEEN)),
        frame(0, read(0.0) + np.array([90.0, 0.0])),
    ):
        shutter = RollingShutter(READOUT_S)
        shutter.settled(before)
        np.testing.assert_array_equal(settled(shutter, frame(1, pixels)), pixels)
    glob = RollingShutter(0.0)
    glob.settled(frame(0, read(0.0)))
    one = frame(1, pixels)
    assert glob.settled(one) is one.picture
    assert RollingShutter(READOUT_S).settled(replace(one, picture=None)) is None


def test_a_calibration_keeps_the_readout() -> None:
    stored = Calibration("a", {"a": CameraCalibration(np.eye(4), readout_ms=22.0)}).to_json()
    assert Calibration.from_json(dict(stored)).cameras["a"].readout_ms == 22.0
    for wrong in (-1.0, 1e4, float("nan")):
        stored["cameras"]["a"]["readout_ms"] = wrong
        with pytest.raises(CalibrationError, match="readout_ms"):
            Calibration.from_json(dict(stored))

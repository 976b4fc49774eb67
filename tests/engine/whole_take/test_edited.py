"""Which part of a take is solved again with edits: nothing outside it, unless edits doubt most of the take."""

import numpy as np
import pytest

from studio.engine.edits.edit import LeaveOutEdit, PinEdit
from studio.engine.edits.pins import Pins
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.whole_take.edited import edited_of
from studio.engine.whole_take.mending.frames import edited_frames
from tests.live.performer import calibration, joints_m

COUNT = 120
STAGE = calibration(["camera_0", "camera_1"])


@pytest.fixture(scope="module")
def frames() -> dict[str, list[CameraFrame]]:
    """Four seconds before two cameras."""
    return {
        name: [
            CameraFrame(name, k, k * 33_333_333, joints_m(k / 30), np.full(JOINT_COUNT, 0.9))
            for k in range(COUNT)
        ]
        for name in STAGE.cameras
    }


def left_out(end_s: float) -> LeaveOutEdit:
    return LeaveOutEdit(id="a", camera="camera_1", start_s=0.5, end_s=end_s)


def pin(start_s: float, end_s: float) -> PinEdit:
    return PinEdit(id="b", joint="left_wrist", place_m=(0.0, 0.0, 1.0), start_s=start_s, end_s=end_s)


@pytest.mark.parametrize(
    ("edits", "whole"),
    [
        ([left_out(1.5)], False),
        ([left_out(3.5)], True),
        ([pin(0.6, 3.0)], False),
        ([pin(0.0, 4.0)], True),
        ([left_out(1.0), pin(1.2, 3.2)], False),
    ],
    ids=["a camera for a second", "a camera for most", "a pin for most", "a pin for all", "both"],
)
def test_what_lies_outside_stays_unless_most_of_the_take_is_doubted(frames, edits, whole):
    edited = edited_frames(frames, STAGE, edits)
    found = edited_of(frames, edited, edits, Pins(edits), STAGE)
    assert (found is None) == whole
    if found is not None:
        times = np.array([0.0, 3.99])
        assert found.share(times, np.zeros(2, dtype=bool))[1] == 0.0

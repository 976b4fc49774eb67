"""The height by which a take is raised comes from feet that no pin calls wrong."""

import numpy as np
import pytest

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.edits.edit import PinEdit
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.mending.floor import lift_of_pins_m
from tests.live.performer import calibration, joints_m

NAMES = ["camera_0", "camera_1"]
STAGE = calibration(NAMES)
COUNT, BEGIN, END, PIN_S = 150, 40, 110, 2.5
LEG = [INDEX[f"left_{name}"] for name in ("knee", "ankle", "toe")]


def lift(sunk_m: float, joint: str) -> float:
    """The lift of a performer who stands 3 cm too low, whose left leg is seen even lower for a while, with a pin of a
    joint."""
    frames: dict[str, list[CameraFrame]] = {}
    for name in NAMES:
        T_camera_stage = invert_transform(STAGE.cameras[name].T_stage_camera)
        frames[name] = []
        for k in range(COUNT):
            joints = joints_m(0.0) - [0.0, 0.0, 0.03]
            if BEGIN <= k < END:
                joints[LEG, 2] -= sunk_m
            seen = transform_points(T_camera_stage, joints)
            frames[name].append(CameraFrame(name, k, round(k * 1e9 / 30), seen, np.full(JOINT_COUNT, 0.9)))
    x, y, z = joints_m(PIN_S)[INDEX[joint]].tolist()
    pin = PinEdit(id="a", joint=joint, place_m=(x, y, z), start_s=PIN_S, end_s=PIN_S)
    return lift_of_pins_m(frames, STAGE, preset("finish"), [pin])


def test_a_leg_that_a_pin_calls_wrong_does_not_raise_the_take():
    true = lift(0.0, "left_wrist")
    assert lift(0.2, "left_ankle") == pytest.approx(true, abs=0.002)
    assert lift(0.2, "left_wrist") > true + 0.05  # nothing says that the leg is wrong

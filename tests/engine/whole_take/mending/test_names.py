"""An error that follows a camera's names is corrected on the other limb while the camera exchanges its sides."""

import numpy as np
import pytest

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.edits.edit import PinEdit
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR
from studio.engine.whole_take.mending.frames import edited_frames
from studio.engine.whole_take.mending.told import PinFinding
from tests.live.performer import calibration, joints_m

NAMES = ["camera_0", "camera_1", "camera_2"]
COUNT, BEGIN, END, PIN = 150, 55, 105, 65
EXCHANGED = {"camera_0": range(80, 120), "camera_1": range(74, 90), "camera_2": range(0)}
ARM = [INDEX[f"left_{name}"] for name in ("elbow", "wrist", "hand")]
SHIFT_M = np.array([0.12, -0.1, 0.12])


def test_what_a_camera_calls_left_is_wrong_and_the_right_arm_is_not_lost_where_it_exchanges_its_sides():
    rng, stage = np.random.default_rng(1), calibration(NAMES)
    true = np.array([joints_m(k / 30) for k in range(COUNT)])
    frames = dict[str, list[CameraFrame]]()
    for name, camera in stage.cameras.items():
        frames[name] = []
        for k in range(COUNT):
            joints = true[k] + 0.01 * rng.normal(size=(JOINT_COUNT, 3))
            joints = joints[MIRROR] if k in EXCHANGED[name] else joints
            if BEGIN <= k < END:
                joints[ARM] += SHIFT_M
            seen = transform_points(invert_transform(camera.T_stage_camera), joints)
            frames[name].append(CameraFrame(name, k, k * 33_333_333, seen, np.full(JOINT_COUNT, 0.9)))
    x, y, z = (true[PIN, ARM[1]] + [0.01, -0.01, 0.01]).tolist()
    pin = PinEdit(id="a", joint="left_wrist", place_m=(x, y, z), start_s=PIN / 30, end_s=PIN / 30)
    told = list[PinFinding]()
    mended = edited_frames(frames, stage, [pin], tell=told.append)
    off = []
    for name, camera in stage.cameras.items():
        for k in range(BEGIN, END):
            joints = transform_points(camera.T_stage_camera, mended[name][k].positions)
            joints = joints[MIRROR] if k in EXCHANGED[name] else joints
            off.append(np.linalg.norm(joints - true[k], axis=1)[[*ARM, *MIRROR[ARM]]])
    known = np.isfinite(off)
    assert known.mean() > 0.9 and np.percentile(np.array(off)[known], 99) < 0.07
    (found,) = told
    assert found.pins == ("a",) and "left_wrist" in found.joints and found.cameras == tuple(NAMES)
    assert (found.start_s, found.end_s) == pytest.approx((BEGIN / 30, (END - 1) / 30), abs=0.1)
    assert not found.guessed
    changes = [(name, edge / 30) for name in NAMES for edge in _edges(EXCHANGED[name])]
    assert sorted(name for name, _ in found.exchanges) == [name for name, _ in changes]
    assert sorted(time_s for _, time_s in found.exchanges) == pytest.approx(
        sorted(time_s for _, time_s in changes), abs=0.04
    )


def _edges(exchanged: range) -> list[int]:
    """The frames within the error at which a camera exchanges its sides."""
    return [edge for edge in (exchanged.start, exchanged.stop) if BEGIN < edge < END]

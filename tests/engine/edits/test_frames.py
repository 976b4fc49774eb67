import numpy as np
import pytest

from studio.engine.edits.edit import ExchangeEdit, LeaveOutEdit
from studio.engine.edits.frames import doubted
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, HandSeen
from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR

CALIBRATION = Calibration("a", {name: CameraCalibration(np.eye(4)) for name in ("a", "b")}, None)


def standing(name: str, exchanged: range = range(0)) -> list[CameraFrame]:
    """Two seconds of a person who stands with arms and legs apart; a camera may exchange sides in some frames."""
    rng = np.random.default_rng(1)
    joints = rng.uniform(-0.1, 0.1, (JOINT_COUNT, 3)) + np.array([0.0, 0.0, 3.0])
    for joint, mirror in enumerate(MIRROR):
        joints[joint, 0] += 0.4 * np.sign(joint - mirror)
    out = []
    for k in range(60):
        seen = joints + rng.normal(size=joints.shape) * 0.01
        seen = seen[MIRROR] if k in exchanged else seen
        hands = (HandSeen("left", "shape", 0.5),)
        out.append(CameraFrame(name, k, round(k * 1e9 / 30), seen, np.ones(JOINT_COUNT), hands))
    return out


def both() -> dict[str, list[CameraFrame]]:
    return {"a": standing("a"), "b": standing("b", range(20, 40))}


def test_without_edits_of_frames_they_are_the_same_object():
    frames = both()
    assert doubted(frames, CALIBRATION, ()) is frames


@pytest.mark.parametrize("joints", [(), ("left_wrist", "head")])
def test_a_camera_or_joints_of_it_are_left_out_over_a_range_and_no_longer(joints):
    frames = both()
    found = doubted(
        frames, CALIBRATION, [LeaveOutEdit(id="x", start_s=0.5, end_s=1.0, camera="a", joints=joints)]
    )
    assert found["b"] is frames["b"]
    gone = [INDEX[name] for name in joints] or list(range(JOINT_COUNT))
    for k, frame in enumerate(found["a"]):
        inside = 15 <= k <= 30
        unseen = np.isnan(frame.positions[:, 0])
        assert np.flatnonzero(unseen).tolist() == (sorted(gone) if inside else [])
        assert (frame.confidence[unseen] == 0.0).all()


def test_an_exchange_at_an_instant_lasts_as_long_as_the_camera_had_its_sides_wrong():
    frames = both()
    found = doubted(frames, CALIBRATION, [ExchangeEdit(id="x", start_s=1.1, end_s=1.1, camera="b")])
    right = standing("b")
    for frame, true in zip(found["b"], right, strict=True):
        assert np.abs(frame.positions - true.positions).max() < 0.2
    assert found["a"] is frames["a"]


def test_an_exchange_over_a_range_is_one_of_that_range_and_of_the_named_joints_on_both_sides():
    frames = both()
    edit = ExchangeEdit(id="x", start_s=0.0, end_s=0.5, camera="a", joints=("left_wrist",))
    found = doubted(frames, CALIBRATION, [edit])["a"]
    left, right = INDEX["left_wrist"], INDEX["right_wrist"]
    np.testing.assert_array_equal(found[3].positions[[left, right]], frames["a"][3].positions[[right, left]])
    np.testing.assert_array_equal(
        found[3].positions[INDEX["left_knee"]], frames["a"][3].positions[INDEX["left_knee"]]
    )
    assert found[20] is frames["a"][20]

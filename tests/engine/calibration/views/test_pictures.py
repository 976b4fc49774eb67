"""Takes and stages of ordinary cameras, whose frames are calibrated as views."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import studio
from studio.__main__ import main
from studio.engine.base.errors import CalibrationError, SettingsError
from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.calibration.calibrate import calibrate, with_performer
from studio.engine.calibration.views.seen.view import View
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.human.anthropometry import anthropometric_positions
from studio.engine.model.joints import JOINT_COUNT, USUAL_TRUNK
from tests.engine.calibration.views.synthetic import HEIGHT_M, camera_at, view_of
from tests.simulator.short_demo import short_demo

EPOCH_NS = 1_700_000_000_000_000_000
LATER_NS = 3_600_000_000_000
"""The second camera's clock is an hour ahead."""


def frames_of(view: View, epoch_ns: int) -> list[CameraFrame]:
    return [
        CameraFrame(
            view.name, k, epoch_ns + round(t * 1e9), np.full((JOINT_COUNT, 3), np.nan), view.confidence[k],
            picture=PictureJoints(view.width, view.height, view.pixels[k], view.world_m[k]),
        )
        for k, t in enumerate(view.time_s)
    ]  # fmt: skip


@pytest.fixture(scope="module")
def frames() -> dict[str, list[CameraFrame]]:
    a = view_of("left", camera_at(0.0), seed=1, seconds=10.0)
    b = view_of("right", camera_at(85.0), seed=2, seconds=10.0, ahead_s=0.3)
    return {"left": frames_of(a, EPOCH_NS), "right": frames_of(b, EPOCH_NS + LATER_NS)}


@pytest.fixture(scope="module")
def found(frames: dict[str, list[CameraFrame]]) -> Calibration:
    return calibrate(frames, height_m=HEIGHT_M)


def test_frames_with_pictures_give_lenses_clocks_and_a_performer(
    frames: dict[str, list[CameraFrame]], found: Calibration
) -> None:
    assert not found.refused, found.reasons
    assert found.reference == "left"
    assert found.performer is not None and found.performer.height_m == pytest.approx(HEIGHT_M, abs=0.02)
    right = found.cameras["right"]
    assert right.clock.stage_ns(EPOCH_NS + LATER_NS) == pytest.approx(EPOCH_NS + 0.3e9, abs=10e6)
    assert right.lens is not None and right.lens.fx == pytest.approx(1000.0, rel=0.05)
    assert right.residual_median_mm is not None and 1.0 < right.residual_median_mm < 40.0
    assert right.coverage is not None and right.coverage > 0.9
    again = with_performer(replace(found, performer=None), frames).performer
    assert again is not None and again.height_m == pytest.approx(HEIGHT_M, rel=0.02)


def test_a_calibration_with_lenses_is_stored_and_read(found: Calibration) -> None:
    again = Calibration.from_json(dict(found.to_json()))
    assert again.cameras["right"].lens == found.cameras["right"].lens
    assert [*again.cameras["right"].reasons] == [*found.cameras["right"].reasons]


def test_the_reference_is_chosen_and_must_have_frames(frames: dict[str, list[CameraFrame]]) -> None:
    assert (
        calibrate(frames, reference="right", until_s=(EPOCH_NS + LATER_NS) * 1e-9 + 6.0).reference == "right"
    )
    with pytest.raises(CalibrationError, match="reference camera 'up'"):
        calibrate(frames, reference="up")


def test_a_t_pose_is_measured_by_all_cameras_together(found: Calibration) -> None:
    still = {name: [seen_in(found.cameras[name], name, k) for k in range(60)] for name in ("left", "right")}
    measured = with_performer(replace(found, performer=None), still).performer
    assert measured is not None and measured.height_m == pytest.approx(TALL_M, rel=0.03)


def test_a_depth_camera_says_where_hips_and_neck_are(found: Calibration) -> None:
    left, right = (found.cameras[name] for name in ("left", "right"))
    mixed = Calibration("deep", {"deep": replace(left, lens=None), "right": right}, None, floor_given=False)
    pictures = [seen_in(right, "right", k) for k in range(60)]
    shown = [
        replace(frame, picture=frame.picture.of_body(USUAL_TRUNK)) for frame in pictures if frame.picture
    ]
    frames = {"deep": [seen_by_depth(left, k) for k in range(60)], "right": shown}
    measured = with_performer(mixed, frames).performer
    assert measured is not None and measured.trunk_shares() == pytest.approx((0.0, 1.042), abs=0.01)


TALL_M = 1.62


def t_pose_before(camera: CameraCalibration) -> np.ndarray:
    return transform_points(invert_transform(camera.T_stage_camera), anthropometric_positions(TALL_M))


def seen_in(camera: CameraCalibration, name: str, k: int) -> CameraFrame:
    """A T-pose in the middle of a calibrated stage, in a picture with a little noise."""
    assert camera.lens is not None
    local = t_pose_before(camera)
    pixels = camera.lens.pixels_of(local) + np.random.default_rng(k).normal(0.0, 1.0, (JOINT_COUNT, 2))
    picture = PictureJoints(camera.lens.width, camera.lens.height, pixels, local - local[0])
    device_ns = k * 33_000_000 - camera.clock.offset_ns
    return CameraFrame(
        name, k, device_ns, np.full((JOINT_COUNT, 3), np.nan), np.ones(JOINT_COUNT), picture=picture
    )


def seen_by_depth(camera: CameraCalibration, k: int) -> CameraFrame:
    """The same T-pose, seen by a depth camera at a camera's place."""
    device_ns = k * 33_000_000 - camera.clock.offset_ns
    return CameraFrame("deep", k, device_ns, t_pose_before(camera), np.ones(JOINT_COUNT))


def test_a_height_that_nobody_has_is_an_error(frames: dict[str, list[CameraFrame]]) -> None:
    with pytest.raises(SettingsError, match="height_m 175"):
        calibrate(frames, height_m=175.0)


def test_a_take_of_simulated_ordinary_cameras(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with short_demo(14.0):
        studio.simulate("demo", tmp_path / "take", cameras=2, tracker="rgb", seed=2, calibration=False)
    assert main(["calibrate", str(tmp_path / "take"), "--height-m", "1.75"]) == 0
    assert "calibration 1 is in use" in capsys.readouterr().out
    stored = studio.open_take(tmp_path / "take").calibration().to_json()
    assert stored["performer"] is not None
    assert stored["performer"]["height_m"] == pytest.approx(1.772, abs=0.01)  # in shoes
    for camera in stored["cameras"].values():
        assert camera["intrinsics"] is not None and camera["intrinsics"]["fx"] > 500
        assert camera["verdict"] != "refused"

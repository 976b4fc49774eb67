"""Cameras without depth are corrected around a pin: their joints are put where they were in the pictures."""

from dataclasses import replace

import numpy as np

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.edits.edit import PinEdit
from studio.engine.model.calibration import Calibration
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.whole_take.mending.frames import edited_frames
from tests.live.performer import calibration, joints_m

NAMES = ["camera_0", "camera_1", "camera_2"]
LENS = Lens(500.0, 500.0, 320.0, 240.0, 640, 480)
COUNT, BEGIN, END, PIN = 150, 55, 100, 80
WRIST, HAND = INDEX["left_wrist"], INDEX["left_hand"]


def seen() -> tuple[dict[str, list[CameraFrame]], Calibration]:
    """A performer in three pictures; all cameras take the wrist for the hip for a while."""
    rng, stage = np.random.default_rng(1), calibration(NAMES)
    cameras = {name: replace(camera, lens=LENS) for name, camera in stage.cameras.items()}
    unseen, frames = np.full((JOINT_COUNT, 3), np.nan), dict[str, list[CameraFrame]]()
    for name, camera in cameras.items():
        frames[name] = []
        for k in range(COUNT):
            pixels = LENS.pixels_of(
                transform_points(invert_transform(camera.T_stage_camera), joints_m(k / 30))
            )
            pixels += rng.normal(size=pixels.shape)
            if BEGIN <= k < END:
                pixels[[WRIST, HAND]] = pixels[INDEX["right_hip"]]
            picture = PictureJoints(640, 480, pixels, unseen)
            frames[name].append(
                CameraFrame(name, k, k * 33_333_333, unseen, np.full(JOINT_COUNT, 0.9), picture=picture)
            )
    return frames, replace(stage, cameras=cameras)


def test_a_lost_wrist_is_put_back_in_all_pictures_and_with_it_the_hand():
    frames, stage = seen()
    x, y, z = (joints_m(PIN / 30)[WRIST] + [0.01, -0.01, 0.01]).tolist()
    pin = PinEdit(id="a", joint="left_wrist", place_m=(x, y, z), start_s=PIN / 30, end_s=PIN / 30)
    mended = edited_frames(frames, stage, [pin])
    for name, camera in stage.cameras.items():
        off_px = []
        for k, (frame, before) in enumerate(zip(mended[name], frames[name], strict=True)):
            assert frame.picture is not None
            if not BEGIN <= k < END:
                if not BEGIN - 2 <= k < END + 2:
                    assert frame is before
                continue
            places = transform_points(
                invert_transform(camera.T_stage_camera), joints_m(k / 30)[[WRIST, HAND]]
            )
            off_px.append(
                np.linalg.norm(frame.picture.pixels[[WRIST, HAND]] - LENS.pixels_of(places), axis=1)
            )
        assert np.mean(off_px, axis=0).max() < 20.0  # 14 cm at this distance; the hip is 60 to 140 away

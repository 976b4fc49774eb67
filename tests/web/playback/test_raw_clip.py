"""A take without a solve in the replay: real skeletons on the stage or side by side, and depth that is told."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import TakeError
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.raw.frames import camera_frames
from studio.web.playback.curves import curves
from studio.web.playback.raw_clip import RATE_HZ, load_raw
from tests.live.performer import calibration


@pytest.fixture
def punches(test_data: Path, tmp_path: Path) -> Take:
    """A take of two cameras' skeletons that was never calibrated."""
    return import_recording(test_data / "noisy_joints" / "punches_2_cameras", tmp_path / "monday" / "punches")


def test_uncalibrated_cameras_show_what_they_saw_side_by_side(punches):
    clip = load_raw(punches)
    frames = camera_frames(punches.raw_path)
    assert clip.holds == {
        "skeletons": {name: len(mine) for name, mine in frames.items()}, "depth": {}, "calibrated": False,
    }  # fmt: skip
    step = clip.step(round(20 * RATE_HZ))
    assert np.isnan(step.positions_m).all() and step.frame_set.cameras == ("camera_0", "camera_1")
    places = np.nanmedian(step.frame_set.positions, axis=1)
    assert places[1, 0] - places[0, 0] > 0.5
    assert np.all(np.nanmin(step.frame_set.positions[..., 2], axis=1) > -0.5)
    assert np.all(np.nanmax(step.frame_set.positions[..., 2], axis=1) < 3.0)
    camera = step.frame_set.positions[0]
    when_ns = frames["camera_0"][0].device_time_ns + 20_000_000_000
    raw = min(frames["camera_0"], key=lambda frame: abs(frame.device_time_ns - when_ns))
    seen = np.isfinite(camera).all(axis=1) & np.isfinite(raw.positions).all(axis=1)
    apart = np.linalg.norm(np.diff(camera[seen], axis=0), axis=1)
    assert np.allclose(apart, np.linalg.norm(np.diff(raw.positions[seen], axis=0), axis=1), atol=0.15)
    drawn = curves(clip, "LeftHand")
    assert drawn.used.keys() == {"camera_0", "camera_1"} and drawn.stance == {"left": [], "right": []}


def test_calibrated_cameras_stand_on_the_stage(punches):
    found = calibration(["camera_0", "camera_1"])
    punches.add_calibration(found, use=True)
    clip = load_raw(punches)
    assert clip.calibration is not None and clip.holds is not None and clip.holds["calibrated"]
    first = next(iter(camera_frames(punches.raw_path)["camera_0"]))
    placed = found.cameras["camera_0"]
    row = clip.nearest(placed.clock.stage_ns(first.device_time_ns) * 1e-9)
    T = placed.T_stage_camera
    wanted = first.positions @ T[:3, :3].T + T[:3, 3]
    got = clip.step(row).frame_set.positions[0]
    both = np.isfinite(wanted).all(axis=1) & np.isfinite(got).all(axis=1)
    assert both.any() and np.abs(wanted[both] - got[both]).max() < 0.2


def test_a_take_with_only_depth_says_what_it_holds(test_data, tmp_path):
    take = import_recording(test_data / "depth" / "walk_2_kinect_v1", tmp_path / "monday" / "walk")
    clip = load_raw(take)
    assert clip.holds is not None and clip.holds["skeletons"] == {} and len(clip.holds["depth"]) == 2
    assert clip.poses.frame_count > 10 and np.isnan(clip.step(0).frame_set.positions).all()


def test_a_take_without_frames_cannot_be_shown(tmp_path):
    take = Take.create(tmp_path / "monday" / "empty", session="monday", name="empty", source="live")
    with pytest.raises(TakeError):
        load_raw(take)

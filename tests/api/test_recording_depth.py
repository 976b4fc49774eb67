"""Depth over the link: it goes into the take while one is recorded, and what does not fit is refused."""

import numpy as np
import pytest

from studio import wire
from studio.take.raw.depth import DepthRecording
from tests.api.camera import Camera, send_frames, wait_until
from tests.api.test_recording import CAMERAS, record
from tests.live.performer import save_stage_calibration


@pytest.fixture
def studio(start_studio, tmp_path):
    """A studio that was calibrated before."""
    save_stage_calibration(tmp_path / "sessions", CAMERAS)
    return start_studio(tmp_path / "sessions")


INTRINSICS = wire.Intrinsics(50.0, 50.0, 19.5, 14.5, 40, 30)


def send_depth(camera: Camera, value: int) -> None:
    camera.send_frame()
    camera.send(wire.depth_image(camera.sequence, camera.clock_ns(), np.full((30, 40), value, np.uint16)))


def test_depth_is_recorded_with_its_skeletons(studio):
    with Camera(studio.url("link"), 0) as first, Camera(studio.url("link"), 1) as second:
        first.greet(intrinsics=INTRINSICS)
        second.greet()
        for camera in (first, second):
            camera.exchange_clocks()
        send_depth(first, 1)  # before the recording: nowhere
        take, _ = record(studio, [first, second], lambda: [send_depth(first, k) for k in range(1000, 1005)])
    depth = DepthRecording(take.raw_path)
    frames = list(depth.frames())
    assert depth.complete and list(depth.cameras) == ["camera_0"] and depth.cameras["camera_0"].width == 40
    assert [int(frame.depth_mm[3, 3]) for frame in frames] == [1000, 1001, 1002, 1003, 1004]
    assert np.diff([frame.sequence for frame in frames]).tolist() == [1, 1, 1, 1]


def test_depth_that_does_not_fit_ends_the_link(studio):
    with Camera(studio.url("link"), 0) as good, Camera(studio.url("link"), 1) as bad:
        good.greet(intrinsics=INTRINSICS)
        bad.greet()
        for camera in (good, bad):
            camera.exchange_clocks()
        send_frames([good, bad], 3)

        def misbehave():
            bad.send(wire.depth_image(9, bad.clock_ns(), np.zeros((30, 40), np.uint16)))
            refused = bad.receive_kind(wire.Refused)
            assert isinstance(refused, wire.Refused) and "intrinsics" in refused.reason

        started = studio.http.post("/record/start", json={"session": "tests"})
        assert started.status_code == 201, started.text
        misbehave()
        wait_until(lambda: (send_frames([good], 1), True)[1], "the other goes on")
        assert studio.http.post("/record/stop").status_code == 200

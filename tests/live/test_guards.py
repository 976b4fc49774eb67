"""What the operator is told of the calibration, cameras that were moved, and performers measured on the stage."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from studio import wire
from studio.engine.base.errors import CalibrationError, SettingsError, TakeError
from studio.live import LiveStage
from studio.live.calibration.guards import age_words, calibration_warnings, shared_usb
from studio.live.calibration.kept import KeptCalibration
from studio.live.calibration.performers import list_profiles, load_profile
from studio.live.cameras.camera import LiveCamera
from studio.take.folder.take import Take
from studio.take.raw.frames import camera_frame
from tests.api.camera import wait_until
from tests.live.performer import calibration, frame, hello, save_stage_calibration
from tests.refused import refused

T_POSE_S, ARMS_DOWN_S = 1.5, 0.5
NOW = datetime(2026, 5, 2, 12, tzinfo=UTC)


class Clock:
    """A clock that a test moves on."""

    def __init__(self):
        self.ns = 1_000_000_000

    def __call__(self):
        return self.ns


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def stage(tmp_path, clock):
    save_stage_calibration(tmp_path, ["camera_0", "camera_1"])
    stage = LiveStage(tmp_path, clock_ns=clock)
    stage.start()
    yield stage
    stage.close()


def feed(stage, links, time_s=None, moved_m=0.0):
    """One frame of every camera of a performer at `time_s`; the second camera sees all of it moved."""
    for index, link in enumerate(links):
        link.sequence = getattr(link, "sequence", 0) + 1
        now = stage.clock_ns()
        seen = frame(index, link.sequence, now, link.sequence / 30 if time_s is None else time_s)
        if moved_m and index == 1:
            joints = np.frombuffer(seen.positions, "<f4").reshape(-1, 3) + np.float32([moved_m, 0, 0])
            seen = wire.skeleton_frame(seen.sequence, now, joints, np.frombuffer(seen.confidence, "<f4"))
        stage.frame(link, seen, wire.encode(seen), now)
    pass_time(stage, 1 / 30)


def pass_time(stage, seconds):
    """Let the stage take in what it was given, then move its clock on."""
    wait_until(lambda: stage.pending() == 0, "the frames are taken in")
    stage.clock_ns.ns += round(seconds * 1e9)


def kept(created=NOW, devices=None):
    return KeptCalibration(1, calibration(["camera_0", "camera_1"]), created.isoformat(), devices)


def cameras(*names, serial="", gone=()):
    made = [LiveCamera(hello(name, serial=serial)) for name in names]
    for camera in made:
        camera.connected = camera.name not in gone
    return made


def words(*given, now=NOW, moved=None):
    return " | ".join(calibration_warnings(*given, moved or {}, now))


def test_a_calibration_that_fits_has_no_warning():
    assert words(kept(), cameras("camera_0", "camera_1")) == ""
    assert words(None, cameras("camera_0")) == ""


def test_cameras_that_are_not_the_calibrated_ones():
    assert "camera_2 was added" in words(kept(), cameras("camera_0", "camera_1", "camera_2"))
    assert "camera_1 is in the calibration and not connected" in words(kept(), cameras("camera_0"))
    assert "not connected" in words(kept(), cameras("camera_0", "camera_1", gone=["camera_1"]))
    nobody = cameras("camera_0", "camera_1", gone=["camera_0", "camera_1"])
    assert "not connected" not in words(kept(), nobody)  # that no camera is here is told once, elsewhere
    swapped = kept(devices={"camera_0": "A", "camera_1": "B"})
    assert "camera_0 is another device now (serial B, calibrated with A)" in words(
        swapped, cameras("camera_0", "camera_1", serial="B")
    )


def test_moved_and_old():
    both = cameras("camera_0", "camera_1")
    assert "camera_1: its joints are 9 cm off" in words(kept(), both, moved={"camera_1": 0.09})
    assert "20 h old" in words(kept(), both, now=NOW + timedelta(hours=20))
    assert words(kept(), both, now=NOW + timedelta(hours=3)) == ""
    assert words(replace(kept(), created=""), both) == ""
    assert [age_words(s) for s in (20, 3000, 7200, 3 * 86400)] == ["1 min", "50 min", "2 h", "3 days"]


def test_a_bumped_camera_is_told_within_five_seconds(stage):
    links = [stage.join(hello(name)) for name in ("camera_0", "camera_1")]
    for _ in range(60):
        feed(stage, links)
    wait_until(lambda: stage.status().cameras["camera_1"].shift_mm is not None, "they are compared")
    assert not any("moved" in text for text in stage.status().calibration.warnings)
    began = stage.status().cameras["camera_1"].frames

    def told():
        feed(stage, links, moved_m=0.15)
        return any("was it moved" in text for text in stage.status().calibration.warnings)

    wait_until(told, "it is told")
    camera = stage.status().cameras["camera_1"]
    assert camera.frames - began <= 5 * 30
    assert (camera.state, camera.limited_by) == ("trouble", "moved")


def test_a_performer_is_measured_in_a_tpose(stage, tmp_path):
    links = [stage.join(hello(name)) for name in ("camera_0", "camera_1")]

    def tpose():
        return stage.status().calibration.tpose

    wait_until(lambda: (feed(stage, links), stage.results.get()[0] > 3)[1], "poses come")
    stage.start_tpose("Ada", 0.1)
    with refused(CalibrationError, "tpose.under_way"):
        stage.start_tpose("Ada")
    wait_until(lambda: (feed(stage, links, ARMS_DOWN_S), tpose().problems)[1], "the pose is called poor")
    assert any("too low" in problem for problem in tpose().problems)
    wait_until(lambda: (feed(stage, links, T_POSE_S), tpose().state == "done")[1], "it is measured")
    assert tpose().height_m == pytest.approx(1.75, abs=0.1)
    (profile,) = list_profiles(tmp_path)
    assert (profile.name, profile.performer.height_m) == ("Ada", tpose().height_m)
    assert stage.status().calibration.number == 2
    stage.use_performer("Ada")
    stage.start_recording("s", "t")
    assert Take.open(tmp_path / "s" / "t").calibration().performer.height_m == profile.performer.height_m


def test_no_tpose_is_told(stage, monkeypatch):
    monkeypatch.setattr("studio.live.calibration.tpose.PATIENCE_S", 0.5)
    links = [stage.join(hello(name)) for name in ("camera_0", "camera_1")]
    wait_until(lambda: (feed(stage, links), stage.results.get()[0] > 3)[1], "poses come")
    stage.start_tpose(countdown_s=0.0)

    def failed():
        feed(stage, links, ARMS_DOWN_S)
        return stage.status().calibration.tpose.state == "failed"

    wait_until(failed, "patience ends")
    assert "too low" in stage.status().calibration.tpose.message
    stage.start_tpose(countdown_s=30.0)
    stage.cancel_tpose()
    assert stage.status().calibration.tpose.state == "idle"


def test_what_is_not_allowed(stage):
    with refused(CalibrationError, "calibration.no_camera_calibrated"):
        stage.start_tpose()
    with refused(SettingsError, "settings.countdown", most=60):
        stage.start_tpose(countdown_s=61)
    with pytest.raises(TakeError):
        stage.start_tpose("../Ada")
    with refused(TakeError, "performer.not_measured", name="Bob"):
        stage.use_performer("Bob")
    with pytest.raises(TakeError):
        load_profile(stage.sessions, "../1")


def slow_camera(name: str, machine: str, controller: str, rate: float) -> LiveCamera:
    """A camera that has sent frames at a rate up to the time 3 s; 30 a second were promised."""
    camera = LiveCamera(hello(name, machine=machine, usb_controller=controller))
    for sequence in range(100):
        seen = camera_frame(name, "canonical", frame(0, sequence, sequence, 0.0))
        camera.saw(seen, round(3e9 - (99 - sequence) * 1e9 / rate))
    return camera


@pytest.mark.parametrize(
    ("second", "told"),
    [
        (("m1", "0000:00:14.0", 12.0), "shares USB controller 0000:00:14.0 with b; plug them into"),
        (("m1", "", 12.0), "as is b on the same machine; plug them into"),
        (("m1", "0000:03:00.0", 12.0), None),
        (("m2", "0000:00:14.0", 12.0), None),
        (("m1", "0000:00:14.0", 30.0), None),
    ],
)
def test_slow_cameras_on_one_usb_controller_are_named(second, told):
    cameras = [slow_camera("a", "m1", "0000:00:14.0", 14.0), slow_camera("b", *second)]
    found = shared_usb(cameras, 3_000_000_000)
    assert set(found) == ({"a", "b"} if told else set())
    assert told is None or found["a"].startswith(told)


@pytest.mark.parametrize(
    ("rate", "busy", "lacks"), [(12.0, 96, "processor"), (12.0, 40, "no_frames"), (30.0, 96, "")]
)
def test_a_client_that_its_processor_holds_up_is_told_so(rate, busy, lacks):
    camera = slow_camera("a", "m1", "", rate)
    camera.client = wire.Status(frames_sent=100, frames_dropped=0, processor_percent=busy)
    told = camera.status(3_000_000_000, reference=True, calibrated=True)
    assert told.limited_by == lacks and told.processor_percent == busy
    assert (lacks == "processor") == ("processor is 96 % busy, 12 of 30 frames" in told.reason)


@pytest.mark.parametrize("code", ["phone_says.rotated", "phone_says.slow", "camera.nobody"])
@pytest.mark.parametrize(("rate", "busy"), [(12.0, 96), (30.0, 10)])
def test_what_a_client_says_of_itself_is_told_at_once(code, rate, busy):
    """Also while it is slow, and after its last frame; that it is slow or sees nobody may have a better reason."""
    camera = slow_camera("a", "m1", "", rate)
    camera.client = wire.Status(
        frames_sent=100,
        frames_dropped=0,
        processor_percent=busy,
        message="words of its own",
        message_code=code,
    )
    camera.heard_ns = 6_000_000_000
    told, silent = (
        camera.status(at, reference=True, calibrated=True) for at in (3_000_000_000, 7_000_000_000)
    )
    assert told.message == "words of its own"
    assert ("words of its own" in told.reason) == (
        code == "phone_says.rotated" or (code, busy) == ("phone_says.slow", 10)
    )
    assert ("words of its own" in silent.reason) == (code == "phone_says.rotated")
    assert silent.limited_by == "no_frames"


def test_a_shared_usb_controller_stands_in_the_status(stage):
    said = {"machine": "m1", "usb_controller": "usb", "frames_per_second": 60.0}
    links = [stage.join(hello(name, **said)) for name in ("camera_0", "camera_1")]
    for _ in range(200):
        feed_now(stage, links)
        if {camera.limited_by for camera in stage.status().cameras.values()} == {"usb"}:
            break
    found = stage.status().cameras["camera_0"]
    assert found.limited_by == "usb" and "camera_1" in found.reason and "60 frames" in found.reason
    assert found.usb_controller == "usb"


def feed_now(stage, links):
    """One frame of every camera, 20 a second."""
    for index, link in enumerate(links):
        link.sequence = getattr(link, "sequence", 0) + 1
        now = stage.clock_ns()
        seen = frame(index, link.sequence, now, 0.0)
        stage.frame(link, seen, wire.encode(seen), now)
    pass_time(stage, 1 / 20)

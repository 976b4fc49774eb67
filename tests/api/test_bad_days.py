"""Bad days of links, clocks and disks within a take, each handled and told."""

import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from studio import wire
from studio.camera.sources.pacing import WallClock
from studio.engine.model.settings.settings import preset
from studio.offline.replay import solve_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawEvent, camera_frames, inspect_raw, read_raw
from studio.take.raw.live_log import SegmentEvent
from studio.take.upkeep.doctor import check_takes
from tests.api.camera import Camera, send_frames, wait_until
from tests.api.test_routes import codes
from tests.live.performer import save_stage_calibration

SECOND = 1_000_000_000
CAMERAS = ["camera_0", "camera_1"]


class Jumping(Camera):
    """A camera whose clock may be set; `sent_s`: when each frame was made, by a clock that never jumps.

    Its machine is a day older than this one, which may have started a minute ago: clocks are never negative.
    """

    jump_ns = 0

    def __init__(self, url: str, index: int, sent_s: list[float] | None = None) -> None:
        super().__init__(url, index)
        self.sent_s: list[float] = [] if sent_s is None else sent_s

    def send_frame(self) -> None:
        self.sent_s.append(time.monotonic())
        super().send_frame()

    def clock_ns(self) -> int:
        return super().clock_ns() + 86_400 * SECOND + self.jump_ns


@dataclass
class Stage:
    studio: object
    cameras: list[Jumping]

    def record(self) -> None:
        self.studio.http.post("/record/start", json={"session": "tests", "take": "bad"}).raise_for_status()
        send_frames(self.cameras, 30)

    def stop(self) -> Take:
        send_frames(self.cameras, 30)
        self.studio.http.post("/record/stop").raise_for_status()
        return Take.open(self.studio.sessions / "tests" / "bad")


@pytest.fixture
def stage(start_studio, tmp_path):
    save_stage_calibration(tmp_path / "sessions", CAMERAS)
    studio = start_studio(tmp_path / "sessions")
    with Jumping(studio.url("link"), 0) as first, Jumping(studio.url("link"), 1) as second:
        for camera in (first, second):
            camera.greet()
        for camera in (first, second):
            for _ in range(3):
                camera.exchange_clocks()
        yield Stage(studio, [first, second])


def exchange(camera: Camera, count: int = 2) -> None:
    for _ in range(count):
        camera.exchange_clocks()


def check_one_clock(take: Take, count: int, cameras: list[Jumping]) -> None:
    """Every frame of both cameras is there, at a time that fits those of the other frames."""
    frames = camera_frames(take.raw_path)
    calibration = take.calibration()
    times = {
        name: np.array([calibration.cameras[name].clock.stage_ns(f.device_time_ns) for f in frames[name]])
        * 1e-9
        for name in CAMERAS
    }
    assert [len(times[name]) for name in CAMERAS] == [count, count]
    late = np.concatenate([times[camera.name] - camera.sent_s for camera in cameras])
    assert np.ptp(late) < 0.2, f"frames are placed up to {np.ptp(late):.2f} s wrong"
    folder = solve_take(take, preset("studio"), name="again")
    assert (folder / "poses.npz").is_file()


@pytest.mark.parametrize("index", [0, 1], ids=["reference", "other"])
@pytest.mark.parametrize("jump_ns", [5 * SECOND, -3600 * SECOND], ids=["ahead", "back"])
def test_a_clock_that_jumps_within_a_take(stage, index, jump_ns):
    stage.record()
    camera = stage.cameras[index]
    camera.jump_ns = jump_ns
    send_frames(stage.cameras, 5)
    exchange(camera)
    take = stage.stop()
    segments = [
        r.event
        for r in read_raw(take.raw_path)
        if isinstance(r, RawEvent) and isinstance(r.event, SegmentEvent)
    ]
    assert [(s.camera, s.from_sequence) for s in segments] == [(camera.name, 31)]
    assert stage.studio.stage.status().cameras[camera.name].clock.jumps == 1
    check_one_clock(take, 65, stage.cameras)


@pytest.mark.parametrize("jump_ns", [5 * SECOND, -3600 * SECOND], ids=["ahead", "back"])
def test_a_clock_that_jumps_without_exchanges(start_studio, tmp_path, jump_ns):
    """A client that never exchanges clocks: its clock is estimated from the arrivals of its frames."""
    save_stage_calibration(tmp_path / "sessions", CAMERAS)
    studio = start_studio(tmp_path / "sessions")
    with Jumping(studio.url("link"), 0) as first, Jumping(studio.url("link"), 1) as second:
        first.greet()
        second.greet()
        exchange(first, 3)
        stage = Stage(studio, [first, second])
        stage.record()
        second.jump_ns = jump_ns
        take = stage.stop()
    segments = [
        r.event
        for r in read_raw(take.raw_path)
        if isinstance(r, RawEvent) and isinstance(r.event, SegmentEvent)
    ]
    assert [(s.camera, s.from_sequence) for s in segments] == [("camera_1", 31)]
    assert studio.stage.status().cameras["camera_1"].clock.source == "arrival"
    check_one_clock(take, 60, stage.cameras)


def test_a_client_that_starts_anew_within_a_take(stage):
    stage.record()
    old = stage.cameras.pop()
    old.socket.close()
    wait_until(lambda: stage.studio.stage.status().cameras["camera_1"].state == "gone", "it is gone")
    with Jumping(stage.studio.url("link"), 1, old.sent_s) as again:
        again.jump_ns, again.sequence = 500 * SECOND, 0
        again.greet(boot_id="boot-2")
        exchange(again)
        stage.cameras.append(again)
        send_frames(stage.cameras, 5)
        take = stage.stop()
    check_one_clock(take, 65, stage.cameras)


def test_a_wall_clock_that_is_stepped_moves_nothing(monkeypatch):
    clock = WallClock()
    before = clock.now_ns()
    real = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: real() + 3600 * SECOND)
    assert 0 <= clock.now_ns() - before < SECOND


def test_a_laptop_that_sleeps_comes_back_with_its_clock_behind(stage):
    """Its monotonic clock stood still meanwhile, and its link was lost."""
    stage.record()
    old = stage.cameras.pop()
    old.socket.close()
    with Jumping(stage.studio.url("link"), 1, old.sent_s) as again:
        again.jump_ns, again.sequence = -40 * SECOND, old.sequence
        again.greet()
        exchange(again)
        stage.cameras.append(again)
        send_frames(stage.cameras, 5)
        take = stage.stop()
    check_one_clock(take, 65, stage.cameras)


@pytest.fixture
def small_disk(tmp_path: Path):
    """A disk of 80 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=80m", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("a small disk cannot be mounted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


@pytest.mark.parametrize("left_mb", [20, 0], ids=["nearly full", "full"])
def test_a_full_disk_ends_the_recording_in_order(small_disk, start_studio, left_mb, caplog):
    save_stage_calibration(small_disk / "sessions", CAMERAS)
    studio = start_studio(small_disk / "sessions")
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        exchange(camera)
        studio.http.post("/record/start", json={"session": "tests", "take": "full"}).raise_for_status()
        send_frames([camera], 60)
        wait_until(lambda: studio.stage.status().recording.frames == 60, "the frames came")
        time.sleep(0.5)
        fill(small_disk / "ballast", left_mb << 20)
        wait_until(
            lambda: (send_frames([camera], 1), not studio.stage.status().recording.active)[1],
            "it ended",
        )
        problem = studio.http.get("/status").json()["recording"]["problem"]
        assert "free some space" in problem
        path = small_disk / "sessions" / "tests" / "full"
        assert inspect_raw(path / "raw.mcap").frames["camera_0"] >= 60
        refused = studio.http.post("/record/start", json={"session": "tests", "take": "next"})
        (code,) = codes(refused.json()["error"])
        assert refused.status_code >= 400 and code in ("recording.disk_low", "file.unwritable_place")
        (small_disk / "ballast").unlink()
        studio.http.post("/record/start", json={"session": "tests", "take": "next"}).raise_for_status()
        send_frames([camera], 10)
        studio.http.post("/record/stop").raise_for_status()
    check_takes(small_disk / "sessions")
    assert check_takes(small_disk / "sessions") == []
    assert inspect_raw(path / "raw.mcap").complete
    assert (path / "solves" / "live" / "poses.npz").is_file()


def fill(path: Path, left_bytes: int) -> None:
    """Fill the disk with a file until only so much is free."""
    block = bytes(1 << 20)
    try:
        with open(path, "wb", buffering=0) as file:
            while shutil.disk_usage(path.parent).free > left_bytes + len(block):
                file.write(block)
            while left_bytes == 0:
                file.write(bytes(4096))
    except OSError:
        return


def test_minutes_left_are_told(stage):
    status = stage.studio.http.get("/status").json()["recording"]
    assert status["minutes_left"] > 0 and status["disk_free_gb"] > 0


def test_frames_of_a_burst_are_recorded_though_the_live_solve_is_past_them(stage):
    stage.record()
    late = [wire.encode(wire.SkeletonFrame(500 + k, 1, b"\0" * 252, b"\0" * 84)) for k in range(3)]
    while not (told := stage.cameras[0].receive_kind(wire.Recording)).active:
        pass
    take_id = told.take_id
    stage.cameras[0].send(wire.Kept(take_id, "boot-1", 500, 502))
    for data in [*late, *late]:
        stage.cameras[0].send(wire.Late(take_id, "boot-1", data))
    wait_until(lambda: stage.studio.stage.status().recording.late_frames == 3, "they are taken in once")
    take = stage.stop()
    assert inspect_raw(take.raw_path).frames == {"camera_0": 63, "camera_1": 60}

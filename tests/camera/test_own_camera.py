"""A program's own camera, and configurations, linked to a server by `studio.run_camera`."""

import asyncio
import threading
from pathlib import Path

import numpy as np
import pytest

import studio
from studio import wire
from studio.camera.client.machine import machine_id
from studio.camera.sources import tracked
from studio.camera.sources.depth_source import DeviceLostError
from studio.camera.sources.steady import Patience, steady
from studio.camera.sources.tracked import ObserverProcess, TrackedSource
from studio.engine.base.errors import SettingsError
from tests.acceptance.processes import sequences, server_process, wait_until
from tests.camera.depth_devices import Device, FixedObserver
from tests.camera.link_server import LinkServer, link_server, running
from tests.refused import refused


class Own(studio.Source):
    """The least that a camera can be: 60 frames, or as many as come until it is ended."""

    name, device, realtime = "own", "a camera of my own", False

    def __init__(self, ended: threading.Event | None = None) -> None:
        self._ended = ended
        self._now_ns = 0

    def clock_ns(self) -> int:
        return self._now_ns

    async def frames(self):
        while self._now_ns < 60 if self._ended is None else not self._ended.is_set():
            self._now_ns += 1
            joints = len(studio.CANONICAL)
            yield studio.SourceFrame(self._now_ns, np.full((joints, 3), 2.0), np.ones(joints))
            await asyncio.sleep(0 if self._ended is None else 0.01)


def linked(source, spool: Path, **options) -> LinkServer:
    """Return a server that the camera was linked to until it ended."""

    async def run() -> LinkServer:
        async with link_server() as server:
            await asyncio.to_thread(studio.run_camera, source, server.url, spool=spool, **options)
        return server

    return asyncio.run(asyncio.wait_for(run(), 120))


def test_an_own_camera_says_what_it_is_and_sends_its_frames(tmp_path):
    server = linked(Own(), tmp_path)
    (hello,) = server.of(wire.Hello)
    assert (hello.name, hello.device, hello.joint_set) == ("own", "a camera of my own", "canonical")
    assert (hello.serial, hello.intrinsics, hello.frames_per_second) == ("", None, 30.0)
    assert hello.machine == machine_id()
    frames = server.of(wire.SkeletonFrame)
    assert [frame.device_time_ns for frame in frames] == list(range(1, 61))
    assert (wire.joint_arrays(frames[0], "canonical")[0] == 2.0).all()


def test_a_configuration_is_linked(tmp_path):
    recorded = tmp_path / "in" / "camera_0"
    recorded.mkdir(parents=True)
    header = [f"{joint}_{part}" for joint in studio.CANONICAL for part in ("x", "y", "z", "confidence")]
    rows = [f"{1 + k / 30:.5f},0.1,0.2,3.{k},0.9" + "," * 80 for k in range(7)]
    (recorded / "joints.csv").write_text("\n".join([",".join(["time_s", *header]), *rows, ""]))
    server = linked(
        studio.RecordingConfig(tmp_path / "in", speed="max"), str(tmp_path / "spool"), name="left"
    )
    assert server.of(wire.Hello)[0].name == "left" and len(server.of(wire.SkeletonFrame)) == 7


def test_an_own_depth_camera_gets_a_tracker(tmp_path, monkeypatch):
    monkeypatch.setattr(
        tracked, "ObserverProcess", lambda name, camera: ObserverProcess(name, camera, FixedObserver)
    )
    server = linked(Device(5, realtime=False), tmp_path / "a", record_depth=True)
    (hello,) = server.of(wire.Hello)
    assert hello.intrinsics is not None and hello.intrinsics.width == 64
    assert len(server.of(wire.SkeletonFrame)) == 5
    source = TrackedSource(Device(5, realtime=False))
    assert len(linked(source, tmp_path / "b", record_depth=True).of(wire.SkeletonFrame)) == 5
    assert source.keep_depth


@pytest.mark.parametrize(
    "source",
    [
        Own(),
        "simulated:0/1",
        studio.SimulatedConfig(0, 1),
    ],
    ids=["camera", "text", "configuration"],
)
def test_a_camera_without_depth_has_nothing_to_preview(source, tmp_path):
    with refused(SettingsError, "source.no_depth"):
        studio.run_camera(source, preview=True, spool=tmp_path)


@pytest.mark.parametrize("base", [studio.Source, studio.DepthSource])
def test_a_camera_that_lacks_what_it_must_have_cannot_be_made(base):
    with pytest.raises(TypeError, match=r"abstract methods? clock_ns, frames"):
        type("Incomplete", (base,), {})()


def test_a_real_server_records_an_own_camera(tmp_path):
    ended = threading.Event()
    with server_process(tmp_path / "sessions") as server:
        client = threading.Thread(
            target=studio.run_camera, args=(Own(ended), server.url), kwargs={"spool": tmp_path / "spool"}
        )
        client.start()
        try:
            wait_until(lambda: server.live_cameras() == 1, "the camera sends")
            path = server.record("own")
            wait_until(lambda: server.status()["recording"]["frames"] > 10, "frames come")
            server.stop()
        finally:
            ended.set()
            client.join(120)
        assert not client.is_alive()
    ((camera, numbers),) = [(key[0], value) for key, value in sequences(path / "raw.mcap").items()]
    assert camera == "own" and numbers == list(range(numbers[0], numbers[0] + len(numbers)))


class Pluggable(Own):
    """Gives three skeletons on its own clock; then the device is lost."""

    joint_set = "openni"

    def __init__(self, serial: str = "A1") -> None:
        super().__init__()
        self.serial = serial

    async def frames(self):
        for k in range(3):
            yield studio.SourceFrame(k, np.zeros((15, 3)), np.ones(15))


def plugged_in(devices: list[studio.Source | studio.DepthSource]):
    """Return the one after the other, then nothing."""

    def open_device() -> studio.Source | studio.DepthSource:
        if not devices:
            raise DeviceLostError("nothing is plugged in")
        return devices.pop(0)

    return steady(open_device, Patience(first_pause_s=0.01))


async def until_problem(source: studio.Source, said: str) -> list[studio.SourceFrame]:
    """Return the frames that come until the source says what is wrong."""
    frames: list[studio.SourceFrame] = []

    async def read() -> None:
        async for frame in source.frames():
            frames.append(frame)

    async with running(read()), asyncio.timeout(60):
        while said not in source.problem:
            await asyncio.sleep(0.001)
    return frames


def test_a_device_of_skeletons_comes_back_on_one_clock():
    source = plugged_in([Pluggable(), Pluggable()])
    assert isinstance(source, studio.Source) and source.realtime
    assert (source.serial, source.joint_set, source.device) == ("A1", "openni", "a camera of my own")
    begin_ns = source.clock_ns()
    frames = asyncio.run(until_problem(source, "nothing is plugged in"))
    stamps = [frame.device_time_ns for frame in frames]
    assert len(stamps) == 6 and stamps == sorted(set(stamps))
    assert begin_ns <= stamps[0] and stamps[-1] <= source.clock_ns()


@pytest.mark.parametrize(
    ("other", "said"),
    [(Pluggable("B2"), "another device"), (Device(3), "other intrinsics")],
    ids=["serial", "kind"],
)
def test_a_device_that_comes_back_as_another_is_not_taken(other, said):
    other.serial = other.serial or "A1"
    source = plugged_in([Pluggable(), other])
    assert len(asyncio.run(until_problem(source, said))) == 3

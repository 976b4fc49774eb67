"""The link is cut within takes, noticed or unnoticed, also while the take ends: nothing is lost, nothing twice."""

import random
import time
from pathlib import Path

import pytest

from studio.take.raw.frames import RawEvent, RawFrame, read_raw
from studio.take.raw.live_log import StartEvent, StoppedEvent
from tests.acceptance.processes import (
    Proxy,
    ServerProcess,
    camera_processes,
    check_nothing_lost,
    server_process,
    wait_until,
)

CAMERAS = 2
PERIOD_S = 1 / 30


BEFORE_S = 2.0
"""Frames that are on their way when a take begins are in it: many, on a busy machine."""


def cut_within_take(server: ServerProcess, proxy: Proxy, cuts_s: list[float], rng: random.Random) -> Path:
    """Record while the link is cut for so long each time; return the take, whole."""
    path = server.record("cut")
    for seconds in cuts_s:
        more_frames(server, round(rng.uniform(10, 30)))
        proxy.cut(silently=rng.random() < 0.5)
        time.sleep(seconds)  # the cut itself
        proxy.mend()
        wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras are back")
        wait_until(lambda: not server.status()["recording"]["missing_frames"], "the gap is filled")
    more_frames(server, 15)
    server.stop()
    wait_until(lambda: server.kept() == 0, "nothing is owed")
    return path


def more_frames(server: ServerProcess, count: int) -> None:
    """Wait until so many more frames of each camera are in the take."""
    wanted = server.status()["recording"]["frames"] + count * CAMERAS
    wait_until(lambda: server.status()["recording"]["frames"] >= wanted, "more frames are recorded")


def covers_the_take(path: Path) -> bool:
    """Whether the last frames of every camera, taken up to the stop, are in the file."""
    records = list(read_raw(path / "raw.mcap"))
    (stopped,) = (r for r in records if isinstance(r, RawEvent) and isinstance(r.event, StoppedEvent))
    (start, *_) = (r for r in records if isinstance(r, RawEvent) and isinstance(r.event, StartEvent))
    seconds = (stopped.time_ns - start.time_ns) * 1e-9
    counts = [
        sum(isinstance(r, RawFrame) and r.camera == f"camera_{i}" for r in records) for i in range(CAMERAS)
    ]
    return min(counts) * PERIOD_S > seconds - 0.15


def run_cuts(tmp_path: Path, cuts_s: list[float]) -> None:
    with server_process(tmp_path / "sessions") as server:
        proxy = Proxy(server.port)
        with camera_processes(tmp_path, f"http://127.0.0.1:{proxy.port}", CAMERAS):
            wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras send")
            path = cut_within_take(server, proxy, cuts_s, random.Random(1))
            wait_until(lambda: check_nothing_lost(path / "raw.mcap") > 0, "the take is whole")
            late = sum(r.late for r in read_raw(path / "raw.mcap") if isinstance(r, RawFrame))
            print(
                f"{len(cuts_s)} cuts: {check_nothing_lost(path / 'raw.mcap')} frames, {late} of them came late"
            )
            assert late > 0
            ended_while_cut(server, proxy)
        proxy.close()


def ended_while_cut(server: ServerProcess, proxy: Proxy) -> None:
    """The link is down when the take is stopped: what was taken until then is filled in afterwards."""
    path = server.record("ended")
    more_frames(server, 30)
    proxy.cut(silently=True)
    time.sleep(1.5)  # the cut itself
    server.stop()
    proxy.mend()
    wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras are back")
    wait_until(lambda: server.kept() == 0, "nothing is owed")
    wait_until(lambda: covers_the_take(path), "what was taken during the cut is in the file")
    check_nothing_lost(path / "raw.mcap")
    records = list(read_raw(path / "raw.mcap"))
    (stopped,) = (r for r in records if isinstance(r, RawEvent) and isinstance(r.event, StoppedEvent))
    (start, *_) = (r for r in records if isinstance(r, RawEvent) and isinstance(r.event, StartEvent))
    seconds = (stopped.time_ns - start.time_ns) * 1e-9
    for name in ("camera_0", "camera_1"):
        count = sum(isinstance(r, RawFrame) and r.camera == name for r in records)
        assert -0.15 < count * PERIOD_S - seconds < BEFORE_S, f"{count} frames in {seconds:.2f} s"


@pytest.mark.timeout(900)
def test_link_cut(tmp_path: Path) -> None:
    """The first cut is noticed by both ends, the second one by none."""
    run_cuts(tmp_path, [0.5, 2.0])


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_link_cut_20_times(tmp_path: Path) -> None:
    rng = random.Random(7)
    run_cuts(tmp_path, [rng.uniform(1.0, 20.0) for _ in range(20)])

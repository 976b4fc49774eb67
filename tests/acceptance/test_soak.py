"""Hours of a studio in small: takes one after the other, replays, links cut, browsers that come and go.

Afterwards no frame is missing, memory is flat and the latency is what it was.
"""

import itertools
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
import pytest
import viser
from websockets.sync.client import ClientConnection

from tests.acceptance.processes import Proxy, ServerProcess, check_nothing_lost, server_process, wait_until
from tests.live.performer import save_stage_calibration
from tests.patient import connect

CAMERAS = 4
NAMES = [f"camera_{index}" for index in range(CAMERAS)]
MOST_GROWTH_MB_AN_HOUR = 60.0
MOST_LATER_MS = 5.0


@dataclass
class Cycle:
    """What one take showed."""

    at_s: float
    memory_mb: float
    latency_ms: float
    step_p99_ms: float
    frames: int
    skipped: int


@dataclass
class Soak:
    """A running studio and what it has shown so far."""

    server: ServerProcess
    proxy: Proxy
    rng: random.Random
    began_s: float = field(default_factory=time.monotonic)
    cycles: list[Cycle] = field(default_factory=list)

    def browsers(self, stack: ExitStack) -> list[ClientConnection]:
        """Open some pages and views. They read all messages, because otherwise they would not close at once."""
        address = self.server.url.replace("http", "ws")
        usual = {"origin": self.server.url, "max_size": None, "max_queue": None}
        paths = ["/api/v1/events", "/api/v1/stream", "/viewer"]
        chosen = [self.rng.choice(paths) for _ in range(self.rng.randrange(1, 5))]
        protocol = {"/viewer": [f"viser-v{viser.__version__}"]}
        return [
            stack.enter_context(connect(address + path, subprotocols=protocol.get(path), **usual))
            for path in chosen
        ]

    def take(self, number: int, seconds: float, *, cut: bool) -> None:
        """Record a take, with the link cut within it or not, replay it, and note how the server is."""
        path = self.server.record(f"take_{number:04d}")
        with ExitStack() as stack:
            self.browsers(stack)
            time.sleep(seconds / 2)
            if cut:
                self.proxy.cut(silently=self.rng.random() < 0.5)
                time.sleep(self.rng.uniform(0.5, 2.0))
                self.proxy.mend()
                wait_until(lambda: self.server.live_cameras() == CAMERAS, "the cameras are back")
            time.sleep(seconds / 2)
            status = self.server.status()
            self.server.stop()
        wait_until(lambda: self.server.kept() == 0, "nothing is owed")
        frames = wait_until(lambda: whole(path), "the take is whole")
        self.replay(f"tests/{path.name}")
        assert self.server.process is not None
        self.cycles.append(
            Cycle(
                time.monotonic() - self.began_s,
                psutil.Process(self.server.process.pid).memory_info().rss / 2**20,
                float(np.median([camera["latency_ms"] or 0.0 for camera in status["cameras"].values()])),
                status["pipeline"]["step_ms_p99"] or 0.0,
                frames,
                sum(camera["skipped"] for camera in status["cameras"].values()),
            )
        )

    def replay(self, take: str) -> None:
        """Play a take's live solve for a moment, and go back to the live stage."""
        self.server.http.put("/replay", json={"take": take, "solve": "live"}).raise_for_status()
        self.server.http.patch("/replay", json={"playing": True, "loop": True}).raise_for_status()
        time.sleep(0.5)
        self.server.http.delete("/replay").raise_for_status()


def whole(path: Path) -> int:
    """Number of a take's frames; 0 while one is missing still."""
    try:
        return check_nothing_lost(path / "raw.mcap")
    except AssertionError:
        return 0


@contextmanager
def running(tmp_path: Path) -> Iterator[Soak]:
    """A studio of four cameras of 25 joints at 30 Hz, in processes of their own, behind a link that can be cut."""
    save_stage_calibration(tmp_path / "sessions", NAMES)
    with server_process(tmp_path / "sessions") as server:
        proxy = Proxy(server.port)
        url = f"http://127.0.0.1:{proxy.port}"
        command = [sys.executable, "-m", "tests.acceptance.load_cameras", url, str(tmp_path), str(CAMERAS)]
        with subprocess.Popen(command, cwd=Path(__file__).parents[2]) as clients:
            try:
                wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras send")
                wait_until(lambda: not server.status()["pipeline"]["preparing"], "the solver is prepared")
                yield Soak(server, proxy, random.Random(5))
            finally:
                clients.terminate()
                assert clients.wait(60) == 0
                proxy.close()


def growth_mb_an_hour(cycles: list[Cycle]) -> float:
    """Slope of the memory. The first third of the time is left out, because buffers fill then."""
    later = [cycle for cycle in cycles if cycle.at_s > cycles[-1].at_s / 3]
    return float(np.polyfit([c.at_s / 3600 for c in later], [c.memory_mb for c in later], 1)[0])


def report(cycles: list[Cycle]) -> None:
    first, last = cycles[: max(len(cycles) // 4, 1)], cycles[-max(len(cycles) // 4, 1) :]
    for name in ("memory_mb", "latency_ms", "step_p99_ms"):
        before, after = (np.median([getattr(c, name) for c in part]) for part in (first, last))
        print(f"{name}: {before:.1f} at first, {after:.1f} in the end")
    print(
        f"{len(cycles)} takes, {sum(c.frames for c in cycles)} frames, none lost; {cycles[-1].skipped} not used live"
    )


@pytest.mark.timeout(900)
def test_soak(tmp_path: Path) -> None:
    with running(tmp_path) as soak:
        for number in range(2):
            soak.take(number, 2.0, cut=number == 1)
        report(soak.cycles)
        assert all(cycle.frames > CAMERAS * 30 for cycle in soak.cycles)
        assert soak.cycles[-1].memory_mb - soak.cycles[0].memory_mb < 60


@pytest.mark.long
@pytest.mark.timeout(5400)
def test_soak_for_an_hour(tmp_path: Path) -> None:
    """`SOAK_S` takes another time than an hour [s]."""
    seconds = float(os.environ.get("SOAK_S", "3600"))
    with running(tmp_path) as soak:
        for number in itertools.count():
            soak.take(number, 10.0, cut=number % 4 == 3)
            if time.monotonic() - soak.began_s > seconds:
                break
        report(soak.cycles)
        growth = growth_mb_an_hour(soak.cycles)
        print(f"memory grows by {growth:.1f} MB an hour")
        part = max(len(soak.cycles) // 4, 1)
        before, after = (
            np.median([c.latency_ms for c in p]) for p in (soak.cycles[:part], soak.cycles[-part:])
        )
        assert after < before + MOST_LATER_MS
        allowed = MOST_GROWTH_MB_AN_HOUR * max(1.0, 3600 / seconds)  # less certain over less time
        assert growth < allowed

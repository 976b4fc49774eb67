"""Malformed, truncated, oversized, wrong-version and flooding clients: no crash, no growth, others undisturbed."""

import random
import threading
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from websockets.exceptions import ConnectionClosed, WebSocketException

from studio import wire
from tests.acceptance.processes import ServerProcess, camera_processes, sequences, server_process, wait_until
from tests.live.performer import frame, hello
from tests.patient import connect

GROWTH_BYTES = 40 << 20


def memory_bytes(server: ServerProcess) -> int:
    """Resident memory of the server."""
    assert server.process is not None
    return int(Path(f"/proc/{server.process.pid}/statm").read_text().split()[1]) * 4096


def bad_messages(rng: random.Random) -> list[bytes]:
    """What a broken or hostile client may say after its hello."""
    good = wire.encode(frame(0, 1, time.monotonic_ns(), 0.0))
    cut = good[: rng.randrange(len(good))]
    flipped = bytearray(good)
    for _ in range(rng.randrange(1, 8)):
        flipped[rng.randrange(len(good))] = rng.randrange(256)
    value = msgspec.msgpack.decode(good)
    value[rng.choice(list(value))] = rng.choice([None, -1, 2**63, "x" * 1000, [], {}, b"", 1.5, True])
    number = rng.randrange(1000)
    others = [
        wire.Kept(rng.randbytes(8).hex(), "b", number, number + 5, hello("other", boot_id="b")),
        wire.Kept("t", rng.randbytes(8).hex(), number, number),
        wire.Late("t", "boot-1", rng.randbytes(60)),
        wire.Late("t", "boot-1", good),
        wire.Ack("t", "b", 5),
        wire.ClockSample(5, 4, 3, 2),
        wire.Welcome("x", True),
        wire.SkeletonFrame(number, 2**61, rng.randbytes(252), rng.randbytes(84)),
    ]
    return [
        cut,
        bytes(flipped),
        rng.randbytes(rng.randrange(200)),
        msgspec.msgpack.encode(value),
        b"\x91" * rng.randrange(1, 5000),
        wire.encode(rng.choice(others)),
    ]


def bad_hello(rng: random.Random) -> bytes:
    names = ["../up", "", "a" * 64, "x\x00", "é", f"c{rng.randrange(10**6)}"]
    values = msgspec.to_builtins(hello("fuzz"))
    values |= rng.choice(
        [
            {"protocol_version": rng.randrange(-5, 99)},
            {"joint_set": "octopus"},
            {"name": rng.choice(names)},
            {"device": "x" * 10**5},
            {"boot_id": "y" * 10**4},
            {"surprise": 1},
            {"frames_per_second": "many"},
        ]
    )
    return msgspec.msgpack.encode(values)


def attack(url: str, rng: random.Random) -> int:
    """One connection that sends nonsense until it is closed; return how many messages it sent."""
    sent = 0
    try:
        with connect(url, compression=None, open_timeout=60, close_timeout=1) as socket:
            kind = rng.random()
            if kind < 0.3:
                socket.send(bad_hello(rng) if kind < 0.2 else rng.choice(bad_messages(rng)))
                sent += 1
            elif kind < 0.32:
                socket.send(wire.encode(hello(f"big{rng.randrange(99)}")))
                socket.send(bytes(wire.MAX_MESSAGE_BYTES + 1))
                sent += 2
            else:
                socket.send(wire.encode(hello(f"fuzz{rng.randrange(200)}", boot_id=rng.randbytes(8).hex())))
                for data in rng.sample(bad_messages(rng), 6):
                    socket.send(data)
                    sent += 1
            if rng.random() < 0.5:
                socket.recv(timeout=1)
    except (ConnectionClosed, WebSocketException, OSError, TimeoutError):
        return sent
    return sent


def flood(url: str, ends: Callable[[], bool]) -> int:
    """Send frames as fast as the network takes them."""
    sent = 0
    with connect(url, compression=None, open_timeout=60, close_timeout=1) as socket:
        socket.send(wire.encode(hello("flood")))
        socket.recv(timeout=60)
        try:
            while not ends():
                socket.send(wire.encode(frame(1, sent, time.monotonic_ns(), 0.0)))
                sent += 1
        except ConnectionClosed:  # it sends so much that it has no time for pings
            return sent
    return sent


def run_fuzz(tmp_path: Path, *, least: int, longest_s: float) -> None:
    rng = random.Random(11)
    with server_process(tmp_path / "sessions") as server, camera_processes(tmp_path, server.url, 1):
        url = f"ws://127.0.0.1:{server.port}{wire.LINK_PATH}"
        wait_until(lambda: server.live_cameras() == 1, "the good camera sends")
        path = server.record("fuzzed")
        for _ in range(20):
            attack(url, rng)
        wait_until(
            lambda: server.status()["pipeline"]["steps"] > 300, "all that a live stage needs is loaded"
        )
        before = memory_bytes(server)
        end = time.monotonic() + longest_s
        floods: list[int] = []
        flooder = threading.Thread(
            target=lambda: floods.append(flood(url, lambda: time.monotonic() > end - longest_s / 2))
        )
        flooder.start()
        sent = 0
        while sent < least and time.monotonic() < end:
            sent += attack(url, rng)
        flooder.join()
        wait_until(
            lambda: server.status()["cameras"]["camera_0"]["state"] in ("live", "trouble"),
            "it is undisturbed",
        )
        growth = memory_bytes(server) - before
        status = server.status()
        assert status["pipeline"]["failures"] == 0 and status["refused_links"]["count"] > 10
        assert len(status["cameras"]) <= 65
        server.stop()
        wait_until(lambda: server.kept() == 0, "nothing is owed")
        print(f"{sent} bad messages, {floods[0]} in the flood, memory grew by {growth / 2**20:.1f} MB")
        assert growth < GROWTH_BYTES
    log = (tmp_path / "sessions.log").read_text()
    assert "Traceback" not in log, log[-3000:]
    (good,) = (numbers for key, numbers in sequences(path / "raw.mcap").items() if key[0] == "camera_0")
    assert sorted(good) == list(range(min(good), max(good) + 1)) and len(good) > 30


@pytest.mark.timeout(900)
def test_fuzz(tmp_path: Path) -> None:
    run_fuzz(tmp_path, least=2000, longest_s=6.0)


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_fuzz_of_10000_messages(tmp_path: Path) -> None:
    run_fuzz(tmp_path, least=12_000, longest_s=1200.0)

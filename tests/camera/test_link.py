import asyncio
import os
import signal
import sys
import time

import numpy as np
import pytest

from studio import wire
from studio.camera.client.frame_queue import FrameQueue
from studio.camera.client.link import QUEUE_FRAMES, Link, RefusedError, link_url
from studio.camera.client.machine import machine_id
from studio.camera.simulated.skeletons import SimulatedSource
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.base.errors import SettingsError, StudioError
from studio.engine.model.joints import JOINT_COUNT
from tests.camera.link_server import link_server, running, welcome
from tests.refused import refused


class Counting(Source):
    """A source that counts in its frames' times; `count` None = for ever, at `period_s`."""

    name, device = "cam", "test"

    def __init__(self, count: int | None = None, *, realtime: bool = False, period_s: float = 0.0) -> None:
        self.count, self.realtime, self.period_s, self.made = count, realtime, period_s, 0

    def clock_ns(self) -> int:
        return time.time_ns() + 5_000_000_000

    async def frames(self):
        while self.count is None or self.made < self.count:
            self.made += 1
            yield SourceFrame(self.made, np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT))
            await asyncio.sleep(self.period_s)


def test_every_frame_of_a_source_that_waits_arrives_in_order_and_the_link_ends():
    async def scenario():
        async with link_server() as server:
            link = Link(Counting(500), server.url, token="secret")
            await asyncio.wait_for(link.run(), 60)
            return server, link

    server, link = asyncio.run(scenario())
    assert server.path == wire.LINK_PATH
    assert isinstance(server.messages[0], wire.Hello)
    assert server.messages[0].token == "secret" and server.messages[0].name == "cam"
    frames = server.of(wire.SkeletonFrame)
    assert [frame.sequence for frame in frames] == list(range(500))
    assert link.frames_sent == 500
    last = server.of(wire.Status)[-1]
    assert (last.frames_sent, last.frames_dropped, last.message) == (500, 0, "")


def test_the_last_frames_arrive_at_a_server_that_is_busy_when_the_source_ends():
    async def scenario():
        def busy_from_now_on(hello: wire.Hello) -> wire.Message:
            server.reading.clear()
            return welcome(hello)

        async with link_server(busy_from_now_on) as server:
            link = Link(Counting(1500), server.url)
            async with running(link.run()) as ended:
                await server.until(lambda: link.frames_sent == 1500)
                await asyncio.sleep(1.5)
                server.reading.set()
                await ended
            await server.until(lambda: len(server.of(wire.SkeletonFrame)) == 1500)
            return server

    server = asyncio.run(scenario())
    assert [frame.sequence for frame in server.of(wire.SkeletonFrame)] == list(range(1500))


def test_clock_exchange_begins_with_a_burst_and_measures_the_offset():
    async def scenario():
        async with link_server() as server, running(Link(Counting(period_s=0.02), server.url).run()):
            await server.until(lambda: len(server.of(wire.ClockSample)) >= 8)
            await asyncio.sleep(0.1)
            return server.of(wire.ClockSample), server.of(wire.Status)

    samples, status = asyncio.run(scenario())
    within_s = (samples[-1].client_receive_ns - samples[0].client_send_ns) * 1e-9
    assert 8 <= len(samples) <= 9 + within_s and status  # one a second after the burst
    for sample in samples:
        assert sample.server_receive_ns <= sample.server_send_ns
        assert sample.client_send_ns < sample.client_receive_ns
    best = min(samples, key=lambda s: s.client_receive_ns - s.client_send_ns)
    ahead = (best.client_send_ns + best.client_receive_ns - best.server_receive_ns - best.server_send_ns) / 2
    way_ns = best.client_receive_ns - best.client_send_ns
    assert ahead == pytest.approx(5e9, abs=max(20e6, way_ns / 2))


def test_it_waits_for_the_server_and_comes_back_when_the_link_breaks(caplog):
    async def scenario():
        async with link_server() as reserved:
            port = reserved.port
        link = Link(Counting(realtime=True, period_s=0.01), f"ws://127.0.0.1:{port}")
        async with running(link.run()):
            await asyncio.sleep(0.4)
            async with link_server(port=port) as server:
                await server.until(lambda: len(server.of(wire.SkeletonFrame)) > 5)
                await server.sockets[0].close()
                await server.until(lambda: len(server.of(wire.Hello)) == 2)
                seen = len(server.of(wire.SkeletonFrame))
                await server.until(lambda: len(server.of(wire.SkeletonFrame)) > seen + 5)
                return server

    server = asyncio.run(scenario())
    first, second = server.of(wire.Hello)
    assert first.boot_id == second.boot_id
    sequences = [frame.sequence for frame in server.of(wire.SkeletonFrame)]
    assert (np.diff(sequences) > 0).all()
    assert "no link to" in caplog.text


def test_a_slow_link_drops_the_oldest_frames_and_says_so():
    async def scenario():
        source = Counting(realtime=True, period_s=0.0)
        async with link_server() as server, running(Link(source, server.url).run()):
            await server.until(lambda: server.of(wire.SkeletonFrame))
            server.reading.clear()
            start = source.made
            await server.until(lambda: source.made > start + 20_000)
            server.reading.set()
            made = source.made
            await server.until(lambda: server.messages and _last(server) > made)
            await server.until(lambda: any(status.frames_dropped for status in server.of(wire.Status)))
            return server

    server = asyncio.run(scenario())
    sequences = [frame.sequence for frame in server.of(wire.SkeletonFrame)]
    assert (np.diff(sequences) > 0).all() and np.diff(sequences).max() > 1000


def _last(server) -> int:
    frames = server.of(wire.SkeletonFrame)
    return frames[-1].sequence if frames else -1


def test_a_refusal_is_an_error_with_the_servers_reason():
    async def scenario():
        async with link_server(
            lambda _: wire.Refused(code="token", reason="wrong token; ask the operator")
        ) as server:
            await asyncio.wait_for(Link(Counting(), server.url).run(), 60)

    with refused(RefusedError, "link.refused", reason="wrong token; ask the operator"):
        asyncio.run(scenario())


def test_a_refusal_after_a_welcome_is_tried_again():
    answers = iter(
        [wire.Welcome(name="cam", reference=True), wire.Refused(code="name", reason="name in use")]
    )

    async def scenario():
        again = wire.Welcome(name="cam", reference=True)
        async with link_server(lambda _: next(answers, again)) as server:
            link = Link(Counting(realtime=True, period_s=0.01), server.url)
            async with running(link.run()):
                await server.until(lambda: server.of(wire.SkeletonFrame))
                await server.sockets[0].close()
                await server.until(lambda: link.connections == 2)

    asyncio.run(scenario())


def test_a_source_that_fails_ends_the_link():
    class Failing(Counting):
        async def frames(self):
            yield SourceFrame(1, np.zeros((JOINT_COUNT, 3)), np.zeros(JOINT_COUNT))
            raise StudioError("the device was unplugged")

    async def scenario():
        async with link_server() as server:
            await asyncio.wait_for(Link(Failing(), server.url).run(), 60)

    with pytest.raises(StudioError, match="unplugged"):
        asyncio.run(scenario())


def test_the_queue_drops_the_oldest():
    async def scenario():
        queue = FrameQueue(3)
        for k in range(5):
            await queue.put(k, bytes([k]), wait=False)
        return [queue.pop() for _ in range(4)], queue.dropped

    assert asyncio.run(scenario()) == ([(2, b"\x02"), (3, b"\x03"), (4, b"\x04"), None], 2)
    assert QUEUE_FRAMES >= 30


def test_the_simulated_performer_in_real_time():
    async def scenario():
        source = SimulatedSource(0, 2)
        async with link_server() as server, running(Link(source, server.url).run()):
            await server.until(lambda: len(server.of(wire.SkeletonFrame)) >= 60)
            return server

    server = asyncio.run(scenario())
    frames = server.of(wire.SkeletonFrame)
    rate = (len(frames) - 1) / ((frames[-1].device_time_ns - frames[0].device_time_ns) * 1e-9)
    assert rate == pytest.approx(30, abs=0.5)
    positions, confidence = wire.joint_arrays(frames[-1], "canonical")
    assert np.nanmedian(positions[:, 2]) == pytest.approx(3.5, abs=1.5)
    assert (confidence > 0.8).sum() > 8
    assert frames[-1].hands


@pytest.mark.parametrize(
    ("server", "url"),
    [
        ("http://127.0.0.1:8000", "ws://127.0.0.1:8000/api/v1/link"),
        ("https://studio.example/", "wss://studio.example/api/v1/link"),
        ("ws://h:1/api/v1/link", "ws://h:1/api/v1/link"),
        ("h:9000", "ws://h:9000/api/v1/link"),
    ],
)
def test_addresses(server, url):
    assert link_url(server) == url


@pytest.mark.parametrize("server", ["", "ftp://h", "http://", "http://h:port", "http://h:0"])
def test_addresses_that_are_none(server):
    with refused(SettingsError, "link.server"):
        link_url(server)


def test_a_name_that_is_not_allowed():
    with refused(SettingsError, "value.bad", name="camera name"):
        Link(Counting(), "h:1", name="a b")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_program_stops_cleanly_on_a_signal(number):
    code = (
        "import sys; from studio.camera.client.run import run_camera; "
        "sys.exit(run_camera('simulated:1/2', sys.argv[1], 'left'))"
    )

    async def scenario():
        async with link_server() as server:
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-c", code, server.url, stderr=asyncio.subprocess.PIPE
            )
            try:
                await server.until(lambda: server.of(wire.SkeletonFrame))
                os.kill(process.pid, number)
                _, errors = await asyncio.wait_for(process.communicate(), 60)
            finally:
                if process.returncode is None:
                    process.kill()
            return process.returncode, errors, server.of(wire.Hello)[0].name

    assert asyncio.run(scenario()) == (0, b"", "left")


def test_hello_says_which_device_it_is_and_on_which_machine():
    source = Counting(3)
    source.serial = "A1"

    async def run():
        async with link_server() as server:
            await Link(source, server.url).run()
        return server

    (said,) = asyncio.run(run()).of(wire.Hello)
    assert said.serial == "A1" and said.machine == machine_id() and said.usb_controller == ""


class Seeing(Counting):
    """A source of depth: a new image with every frame."""

    @property
    def newest_depth(self):
        return self.made, np.full((48, 64), 1000, np.uint16)


@pytest.mark.parametrize("waiting", [0, 5])
def test_previews_are_small_and_left_out_while_frames_wait(monkeypatch, waiting):
    monkeypatch.setattr(FrameQueue, "__len__", lambda self: waiting)

    async def run():
        async with link_server() as server:
            source = Seeing(realtime=True, period_s=1 / 30)
            async with running(Link(source, server.url).run()):
                await server.until(lambda: len(server.of(wire.SkeletonFrame)) > 30)
        return server

    server = asyncio.run(run())
    previews, images = server.of(wire.Preview), len(server.of(wire.SkeletonFrame))
    assert len(previews) <= images if waiting == 0 else previews == []
    assert all(wire.preview_array(one).max() == 1000 and one.width == 64 for one in previews)
    assert waiting or previews

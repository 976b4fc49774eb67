"""Depth cameras in the client: unplugged ones come back, images become skeletons, the preview shows them."""

import asyncio
import logging

import httpx
import numpy as np
import pytest

from studio import wire
from studio.camera.client.link import Link
from studio.camera.client.preview import PreviewPage, health, png_picture, text_picture
from studio.camera.sources import tracked
from studio.camera.sources.depth_source import DeviceLostError
from studio.camera.sources.steady import DeviceClock, Patience, steady
from studio.camera.sources.tracked import ObserverProcess, TrackedSource
from studio.engine.base.errors import SettingsError, StudioError
from tests.camera.depth_devices import CAMERA, BrokenObserver, CoupleObserver, Device, FixedObserver
from tests.camera.link_server import LinkServer, link_server, running
from tests.refused import refused


async def take(source, count: int) -> list:
    out = []
    async for item in source.frames():
        out.append(item)
        if len(out) == count:
            break
    return out


@pytest.mark.parametrize(
    ("end", "said"), [("end", "no more"), ("raise", "cable"), ("silent", "no image for 0.1 s")]
)
def test_a_lost_device_is_opened_again(end: str, said: str, caplog: pytest.LogCaptureFixture) -> None:
    openings = []

    def open_device() -> Device:
        openings.append(1)
        if len(openings) in (2, 3):
            raise DeviceLostError("nothing is plugged in")
        return Device(3, end)

    source = steady(open_device, Patience(silent_s=0.1, first_pause_s=0.01))
    with caplog.at_level(logging.WARNING):
        shots = asyncio.run(take(source, 6))
    assert [int(depth[0, 0]) for _, depth in shots] == [1000, 1001, 1002] * 2
    assert all(np.diff([time_ns for time_ns, _ in shots]) > 0)
    assert len(openings) == 4 and source.problem == ""
    assert said in caplog.text and "nothing is plugged in" in caplog.text and "is back" in caplog.text


def test_a_device_that_comes_back_as_another_is_not_taken() -> None:
    openings = []

    def open_device() -> Device:
        openings.append(1)
        other = CAMERA if len(openings) == 1 else type(CAMERA)(61.0, 60.0, 31.5, 23.5, 64, 48)
        return Device(1, camera=other)

    source = steady(open_device, Patience(first_pause_s=0.01))

    async def run() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(take(source, 2), 0.3)

    asyncio.run(run())
    assert "other intrinsics" in source.problem


def test_a_device_that_is_not_there_at_the_start_is_an_error() -> None:
    def open_device() -> Device:
        raise DeviceLostError("no camera is plugged in")

    with pytest.raises(DeviceLostError, match="plugged in"):
        steady(open_device)


def test_the_device_clock_counts_the_shortest_delay() -> None:
    clock = DeviceClock()
    assert [clock.host_ns(k * 10, 1000 + k * 10 + late) for k, late in enumerate((5, 0, 7, 3))] == [
        1005,
        1010,
        1020,
        1030,
    ]


def test_images_become_skeletons_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        tracked, "ObserverProcess", lambda name, camera: ObserverProcess(name, camera, FixedObserver)
    )
    source = TrackedSource(Device(5, realtime=False), keep_depth=True)
    assert source.intrinsics is not None and source.intrinsics.width == 64

    async def run() -> list:
        return [frame async for frame in source.frames()]

    frames = asyncio.run(run())
    assert [round(float(f.positions[0, 2]), 3) for f in frames] == [1.0, 1.001, 1.002, 1.003, 1.004]
    assert frames[2].depth_mm is not None and frames[2].depth_mm[0, 0] == 1002
    assert frames[0].hands[0].open_probability == 0.75 and frames[0].head_wxyz == (1.0, 0.0, 0.0, 0.0)
    assert 900 < source.measured_rate < 1100 and "tracked" in health(source)


def test_depth_goes_over_the_link_while_a_take_is_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        tracked, "ObserverProcess", lambda name, camera: ObserverProcess(name, camera, CoupleObserver)
    )

    async def run() -> LinkServer:
        async with link_server() as server:
            source = TrackedSource(Device(40_000), keep_depth=True)
            async with running(Link(source, server.url).run()):
                await server.until(lambda: len(server.of(wire.SkeletonFrame)) > 2, 60)
                await server.sockets[0].send(wire.encode(wire.Recording(active=True, take="t")))
                await server.until(lambda: len(server.of(wire.DepthImage)) > 2, 60)
        return server

    server = asyncio.run(run())
    (hello,) = server.of(wire.Hello)
    assert hello.intrinsics is not None and (hello.intrinsics.width, hello.intrinsics.height) == (64, 48)
    skeletons = {frame.sequence: frame for frame in server.of(wire.SkeletonFrame)}
    assert 0 not in {image.sequence for image in server.of(wire.DepthImage)}
    for image in server.of(wire.DepthImage):
        depth_mm = wire.depth_array(image, hello.intrinsics)
        first, second = wire.each_body(skeletons[image.sequence])
        assert (first.body, second.body, second.head_wxyz) == (0, 4, None) and second.hands
        for x_m, body in enumerate((first, second)):
            positions, _ = wire.joint_arrays(body, "canonical")
            assert positions[0].tolist() == pytest.approx([x_m, 0.0, depth_mm[0, 0] * 1e-3])
        assert image.device_time_ns == skeletons[image.sequence].device_time_ns


def test_an_observer_that_fails_is_told() -> None:
    with ObserverProcess("a", CAMERA, FixedObserver) as process:
        process.wait_ready()
        with refused(StudioError, "tracker.failed", error="ValueError: number thirteen"):
            process.observe(0, np.full((48, 64), 13, np.uint16))
        with refused(StudioError, "tracker.ended"):
            process.observe(0, np.full((48, 64), 1000, np.uint16))
    with (
        ObserverProcess("a", CAMERA, BrokenObserver) as process,
        refused(
            StudioError, "tracker.failed", error="studio.engine.base.errors.StudioError: no weights here"
        ),
    ):
        process.wait_ready()


def test_the_preview_as_text_and_as_a_page() -> None:
    source = TrackedSource(Device(1))
    depth = np.full((48, 64), 4000, np.uint16)
    depth[10:30, 20:40] = 1000
    seen = FixedObserver("a", CAMERA).observe(0, depth)
    text = text_picture(depth, CAMERA, seen.positions)
    assert text.count("\n") == 25 and "O" in text and "%" in text
    assert png_picture(depth, CAMERA, seen.positions).startswith(b"\x89PNG")
    beside = seen.positions + np.array([0.2, 0.0, 0.0])
    assert text_picture(depth, CAMERA, seen.positions, beside).count("O") == 2 * text.count("O")
    source.latest, source.status = (depth, seen), "tracked"

    async def run() -> None:
        page = PreviewPage(source, 0)
        await page.start()
        other = PreviewPage(source, page.port)
        with refused(SettingsError, "camera.preview_port"):
            await other.start()
        async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{page.port}", trust_env=False) as client:
            assert "<img" in (await client.get("/")).text
            assert "software camera" in (await client.get("/status.json")).json()["text"]
            assert (await client.get("/image.png?1")).content.startswith(b"\x89PNG")
            assert (await client.get("/other")).status_code == 404
        await page.close()

    asyncio.run(run())

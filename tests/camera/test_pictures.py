"""Webcams and videos as cameras: real pictures, real models."""

import asyncio
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from studio import wire
from studio.camera.client.link import Link
from studio.camera.devices import webcam
from studio.camera.sources.depth_source import DeviceLostError
from studio.camera.sources.registry import open_source
from studio.camera.sources.steady import Patience, steady
from studio.camera.sources.video import VideoConfig
from tests.camera.link_server import link_server, running
from tests.refused import refused
from tests.take.video_files import real_pictures, write_video

LIMBS = slice(11, 29)


async def first(source, count: int) -> list:
    frames = []
    async for frame in source.frames():
        frames.append(frame)
        if len(frames) == count:
            break
    return frames


@pytest.fixture(scope="module")
def person(test_data) -> list[np.ndarray]:
    return real_pictures(test_data / "rgb" / "pose2sim_single", "cam01", 4, every=5)


@pytest.fixture(scope="module")
def video(person, tmp_path_factory) -> Path:
    return write_video(tmp_path_factory.mktemp("videos") / "left phone.mp4", person, [0, 40, 70, 130])


def test_a_video_plays_once_with_its_own_times(video):
    source = open_source(f"video:{video}?speed=max&model=lite")
    frames = asyncio.run(first(source, 10))
    assert source.name == "left_phone" and source.joint_set == "mediapipe" and source.problem == ""
    assert [frame.device_time_ns // 1_000_000 for frame in frames] == [0, 40, 70, 130]
    assert source.clock_ns() == frames[-1].device_time_ns
    for frame in frames:
        assert (frame.picture.width, frame.picture.height) == (360, 640)
        assert np.isfinite(frame.picture.pixels).all() and frame.picture.world_m.shape == (33, 3)
        assert np.isnan(frame.positions).all() and frame.confidence.shape == (33,)


def test_a_video_plays_over_and_over_in_real_time(video):
    source = open_source(f"video:{video}?model=lite")
    before_ns = source.clock_ns()
    frames = asyncio.run(first(source, 6))
    stamps = [frame.device_time_ns for frame in frames]
    assert stamps == sorted(set(stamps)) and source.clock_ns() >= stamps[-1] > before_ns - 2_000_000_000
    assert source.passed_over + len(frames) >= 6


def test_a_mirrored_camera_is_turned_back(person, video, tmp_path):
    selfie = write_video(tmp_path / "selfie.mp4", [np.ascontiguousarray(one[:, ::-1]) for one in person])
    (straight,) = asyncio.run(first(open_source(f"video:{video}?speed=max"), 1))
    (turned,) = asyncio.run(first(open_source(f"video:{selfie}?speed=max&mirrored"), 1))
    apart = np.linalg.norm(turned.picture.pixels - straight.picture.pixels, axis=1)
    assert np.median(apart[LIMBS]) < 4


def test_a_picture_of_a_video_is_shown(video):
    assert VideoConfig(video).picture().shape == (640, 360, 3)


def test_nobody_and_several_people_are_told(person, test_data, tmp_path):
    gone = np.full_like(person[0], 90)
    empty = open_source(f"video:{write_video(tmp_path / 'empty.mkv', [gone])}?speed=max&model=lite")
    (frame,) = asyncio.run(first(empty, 2))
    assert empty.problem.code == "camera.nobody"
    assert np.isnan(frame.picture.pixels).all() and (frame.confidence == 0).all()
    two = real_pictures(test_data / "rgb" / "pose2sim_two", "cam01", 1, small=2)
    crowd = open_source(f"video:{write_video(tmp_path / 'two.mkv', two)}?speed=max&model=lite")
    asyncio.run(first(crowd, 2))
    assert crowd.problem.code == "camera.several" and crowd.problem.values == {"n": 2}


def test_too_many_pictures_are_told(person, tmp_path):
    """Its frames come at 5 Hz though the file says 30."""
    path = write_video(tmp_path / "slow.mkv", [person[0]] * 2)
    source = open_source(f"video:{path}?model=lite")
    source._done_ns.extend(200_000_000 * k for k in range(60))
    assert source.problem.code == "camera.skips" and source.problem.values["read"] == 5


def test_the_studio_gets_landmarks_and_what_is_wrong(video, tmp_path):
    """By the real link: the messages that a server receives."""
    gone = write_video(tmp_path / "gone.mkv", [np.full((240, 320, 3), 90, np.uint8)] * 3)

    async def run() -> None:
        for path, problem in ((video, ""), (gone, "camera.nobody")):
            async with link_server() as server:
                link = Link(open_source(f"video:{path}?model=lite"), server.url)
                async with running(link.run()):
                    await server.until(
                        lambda server=server, problem=problem: (
                            len(server.of(wire.SkeletonFrame)) > 3
                            and any(one.message_code == problem for one in server.of(wire.Status))
                        )
                    )
            frame = server.of(wire.SkeletonFrame)[-1]
            seen = wire.landmark_arrays(frame, "mediapipe")
            assert seen is not None and bool(np.isfinite(seen.pixels).all()) == (not problem)

    asyncio.run(run())


@pytest.fixture
def played_webcam(video, monkeypatch) -> None:
    """A capture device of the same library that plays a file: no camera is here."""
    address = f"movie={str(video).replace(' ', chr(92) * 3 + ' ')}"
    monkeypatch.setattr(webcam, "_address", lambda number: (address, "lavfi", [{"no": "such"}, {}]))


def test_a_webcam_gives_landmarks_and_is_opened_again(played_webcam):
    openings = []

    def open_device():
        openings.append(1)
        return webcam.WebcamConfig(model="lite").open()

    source = steady(open_device, Patience(first_pause_s=0.01))
    frames = asyncio.run(first(source, 6))
    assert source.device == "webcam 0, 360 x 640" and source.name == "webcam_0"
    assert all(frame.picture is not None and frame.picture.width == 360 for frame in frames)
    assert all(a.device_time_ns < b.device_time_ns for a, b in pairwise(frames))
    assert len(openings) > 1


def test_a_webcam_that_is_not_there_is_said():
    with refused(DeviceLostError, "device.no_webcam"):
        webcam.WebcamConfig(99).open()
    with refused(DeviceLostError, "device.no_webcam"):
        webcam.WebcamConfig(99).picture()


def test_a_webcam_that_cannot_be_opened_is_said(monkeypatch):
    monkeypatch.setattr(webcam, "_address", lambda number: ("nonsense=", "lavfi", [{}]))
    with refused(DeviceLostError, "device.webcam_closed"):
        webcam.WebcamConfig(0).open()

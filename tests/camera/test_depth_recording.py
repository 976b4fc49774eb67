"""Recorded depth as a camera: once with its own times, or over and over in step with the wall clock."""

import asyncio
from pathlib import Path

import numpy as np
import pytest

from studio.camera.sources.depth_recording import DepthRecordingSource
from studio.camera.sources.recording import RecordingConfig
from studio.camera.sources.registry import open_source
from studio.camera.sources.tracked import TrackedSource
from studio.engine.base.errors import FormatError
from studio.take.importers import import_recording
from tests.refused import refused
from tests.take.test_depth_files import k4a_file
from tests.take.test_raw_depth import image, png_camera


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for k in (0, 1):
        png_camera(tmp_path / "in" / f"camera_{k}", k, 12)
    return tmp_path / "in"


async def first(source: DepthRecordingSource, count: int) -> list:
    out = []
    async for shot in source.frames():
        out.append(shot)
        if len(out) == count:
            break
    return out


@pytest.mark.parametrize("kind", ["folder", "take", "raw", "mkv"])
def test_every_kind_plays_once_with_its_times(folder: Path, tmp_path: Path, kind: str) -> None:
    path = {"folder": folder, "mkv": tmp_path / "a.mkv"}.get(kind, tmp_path / "take")
    if kind == "mkv":
        k4a_file(path, 3)
    elif kind != "folder":
        import_recording(folder, path)
    path = path / "raw.mcap" if kind == "raw" else path
    source = RecordingConfig(path, "" if kind == "mkv" else "camera_1", "max").open()
    assert isinstance(source, DepthRecordingSource) and not source.realtime
    shots = asyncio.run(first(source, 100))
    assert len(shots) == (3 if kind == "mkv" else 12)
    assert all(np.diff([time_ns for time_ns, _ in shots]) > 0) and source.clock_ns() == shots[-1][0]
    assert shots[0][1].shape == (source.camera.height, source.camera.width)
    if kind != "mkv":
        np.testing.assert_array_equal(shots[5][1], image(1, 5))
    assert isinstance(
        open_source(f"recording:{path}" if kind == "mkv" else f"recording:{path}#camera_1"), TrackedSource
    )


def test_clients_of_one_recording_play_the_same_moment(folder: Path) -> None:
    async def both() -> list:
        sources = [RecordingConfig(folder, f"camera_{k}").open() for k in (0, 1)]
        return await asyncio.gather(*(first(source, 8) for source in sources))

    one, other = asyncio.run(both())
    numbers = {int(depth.sum()): k for k in range(12) for depth in (image(0, k), image(1, k))}
    by_time = {round(time_ns / 1e6): numbers[int(depth.sum())] for time_ns, depth in one}
    shared = [
        (numbers[int(d.sum())], by_time[round(t / 1e6) - 1])
        for t, d in other
        if round(t / 1e6) - 1 in by_time
    ]
    assert len(shared) >= 3 and all(a == b for a, b in shared)  # the second clock is a millisecond ahead


def test_a_recording_without_an_image_is_an_error(folder: Path) -> None:
    for file in (folder / "camera_1" / "depth").iterdir():
        file.write_bytes(b"")
    with refused(FormatError, "depth.none_readable", name="camera_1"):
        RecordingConfig(folder, "camera_1").open()

"""The worked examples of docs/extending.md run as they stand there."""

import asyncio
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from studio.camera import sources
from studio.camera.sources import SOURCES, Kind, open_source
from studio.camera.tracked import ObserverProcess
from studio.engine import settings
from studio.engine.conditioning import filters
from studio.engine.depth import DepthCamera
from studio.engine.export import EXPORTERS, Exporter, export
from studio.engine.joints import INDEX, JOINT_SETS
from studio.engine.settings import preset, set_switch
from tests.poses_factory import random_poses

TEXT = (Path(__file__).parents[1] / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.S)
NAMES = {"marionette", "wall", "nearest", "mean_of_two", "heights"}


@pytest.fixture
def example(tmp_path, monkeypatch):
    """A function that writes an example's file and returns its module; registries are put back afterwards."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def module(stem: str):
        (code,) = [block for block in BLOCKS if re.match(rf"# studio/\S+/{stem}\.py\n", block)]
        (tmp_path / f"{stem}.py").write_text(code)
        return __import__(stem)

    yield module
    for name in NAMES:
        sys.modules.pop(name, None)


def registration(starts: str, **names: object) -> None:
    """Run the lines that put an example into its registry; its module stands beside the test here."""
    (code,) = [block for block in BLOCKS if re.search(rf"^{re.escape(starts)}", block, re.M)]
    exec(re.sub(r'"studio(\.\w+)*\.(\w+)"', r'"\2"', code), dict(names))


def take(source, count: int) -> list:
    async def frames():
        return [frame async for _, frame in counted(source.frames(), count)]

    with ThreadPoolExecutor(1) as thread:  # a browser's loop may run in this one
        return thread.submit(asyncio.run, frames()).result()


async def counted(frames, count: int):
    for number in range(count):
        yield number, await anext(frames)


def test_every_example_is_tested():
    files = {Path(match).stem for match in re.findall(r"^# (studio/\S+\.py)$", "\n".join(BLOCKS), re.M)}
    assert files == NAMES


def test_a_camera_that_gives_skeletons(example, monkeypatch):
    example("marionette")
    monkeypatch.setattr(sources, "SOURCES", dict(SOURCES))
    registration('SOURCES["marionette"]', SOURCES=sources.SOURCES, Kind=Kind)
    source = open_source("marionette")
    for frame in take(source, 3):
        assert frame.positions.shape == (len(JOINT_SETS[source.joint_set]), 3)
        assert np.isfinite(frame.positions).all() and (frame.confidence == 1).all()


def test_a_camera_that_gives_depth(example, monkeypatch):
    wall = example("wall")
    monkeypatch.setattr(sources, "SOURCES", dict(SOURCES))
    registration('SOURCES["wall"]', SOURCES=sources.SOURCES, Kind=Kind)
    tracked = open_source("wall")
    assert tracked.intrinsics is not None and tracked.joint_set == "canonical"
    ((_, depth_mm),) = take(wall.open_wall(""), 1)
    assert depth_mm.shape == (wall.Wall.camera.height, wall.Wall.camera.width)


def test_a_tracker(example):
    make = example("nearest").make_nearest
    camera = DepthCamera(width=160, height=120, fx=140.0, fy=140.0, cx=79.5, cy=59.5)
    depth_mm = np.full((120, 160), 3000, dtype=np.uint16)
    depth_mm[59, 79] = 2000
    with ObserverProcess("one", camera, make) as process:
        process.wait_ready()
        seen = process.observe(5, depth_mm)
    assert seen.time_ns == 5 and seen.status == "tracked"
    assert seen.positions[INDEX["hips"]] == pytest.approx([0, 0, 2], abs=0.02)


def test_a_filter(example, monkeypatch):
    MeanOfTwo = example("mean_of_two").MeanOfTwo
    monkeypatch.setattr(filters, "FILTERS", dict(filters.FILTERS))
    monkeypatch.setattr(settings, "CHOICES", dict(settings.CHOICES))
    registration(
        'FILTERS["mean_of_two"]', FILTERS=filters.FILTERS, CHOICES=settings.CHOICES, MeanOfTwo=MeanOfTwo
    )
    chosen = set_switch(preset("raw"), "smoothing", "mean_of_two:after")
    assert chosen.smoothing == "mean_of_two:after"
    one = filters.FILTERS["mean_of_two"]()
    assert (one.apply(np.zeros((2, 3)), 1 / 60) == 0).all()
    assert (one.apply(np.ones((2, 3)), 1 / 60) == 0.5).all()
    unseen = one.apply(np.full((2, 3), np.nan), 1 / 60)
    assert np.isnan(unseen).all() and (one.apply(np.ones((2, 3)), 1 / 60) == 1).all()


def test_an_exporter(example, monkeypatch, tmp_path):
    write_heights = example("heights").write_heights
    monkeypatch.setitem(EXPORTERS, "heights", None)
    registration('EXPORTERS["heights"]', EXPORTERS=EXPORTERS, Exporter=Exporter, write_heights=write_heights)
    poses = random_poses(np.random.default_rng(1), seconds=0.3)
    export(poses, tmp_path / "out.txt", "heights")
    rows = np.loadtxt(tmp_path / "out.txt")
    assert rows.shape == (poses.frame_count, 2)
    assert rows[:, 1] == pytest.approx(poses.positions_m[:, 0, 2], abs=1e-4)

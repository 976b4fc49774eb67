"""The worked examples of docs/extending.md run as they stand there."""

import asyncio
import os
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import studio
from studio import wire
from studio.camera.sources import registry
from studio.camera.sources.tracked import ObserverProcess
from studio.engine.animation.export import EXPORTERS, Exporter, export
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX, JOINT_SETS
from studio.engine.model.settings import settings
from studio.engine.model.settings.settings import preset, set_switch
from studio.engine.solve.conditioning import filters
from tests.camera.link_server import link_server
from tests.poses_factory import random_poses

TEXT = (Path(__file__).parents[1] / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.S)
NAMES = {"marionette", "wall", "nearest", "mean_of_two", "heights"}


@pytest.fixture
def example(tmp_path, monkeypatch):
    """A function that writes an example's file and returns its module; registries are put back afterwards."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def module(stem: str):
        (code,) = [block for block in BLOCKS if re.match(rf"# (studio/\S+/)?{stem}\.py\n", block)]
        (tmp_path / f"{stem}.py").write_text(code)
        return __import__(stem)

    yield module
    for name in NAMES:
        sys.modules.pop(name, None)


def registration(starts: str, **names: object) -> None:
    """Run the lines that put an example into its registry."""
    (code,) = [block for block in BLOCKS if re.search(rf"^{re.escape(starts)}", block, re.M)]
    exec(code, dict(names))


def take(source, count: int) -> list:
    async def frames():
        return [frame async for _, frame in counted(source.frames(), count)]

    with ThreadPoolExecutor(1) as thread:  # a browser's event loop may run in this thread
        return thread.submit(asyncio.run, frames()).result()


async def counted(frames, count: int):
    for number in range(count):
        yield number, await anext(frames)


def test_every_example_is_tested():
    files = {Path(match).stem for match in re.findall(r"^# (\S+\.py)$", "\n".join(BLOCKS), re.M)}
    assert files == NAMES


def test_a_camera_that_gives_skeletons(example, monkeypatch):
    marionette = example("marionette")
    monkeypatch.setattr(registry, "SOURCES", dict(registry.SOURCES))
    registration("add_source", add_source=studio.add_source, MarionetteConfig=marionette.MarionetteConfig)
    assert registry.written("marionette") == "marionette[:<metres>]"
    assert studio.open_source("marionette").metres == 0.2
    with pytest.raises(studio.SettingsError, match="give metres"):
        studio.open_source("marionette:far")
    source = studio.open_source("marionette:0.3")
    for frame in take(source, 3):
        assert frame.positions.shape == (len(JOINT_SETS[source.joint_set]), 3)
        assert (abs(frame.positions[:, 0]) <= 0.3).all() and (frame.confidence == 1).all()


def test_a_program_that_links_its_own_camera(example, tmp_path):
    example("marionette")
    (code,) = [block for block in BLOCKS if block.startswith("# in a program of your own")]

    async def run():
        async with link_server() as server:
            text = code.replace("http://127.0.0.1:8000", server.url)
            (tmp_path / "program.py").write_text(
                f"from marionette import Marionette\nfrom studio import run_camera\n{text}"
            )
            environment = dict(os.environ, XDG_STATE_HOME=str(tmp_path / "state"))
            process = await asyncio.create_subprocess_exec(
                sys.executable, str(tmp_path / "program.py"), env=environment
            )
            try:
                await server.until(lambda: len(server.of(wire.SkeletonFrame)) > 2)
            finally:
                process.terminate()
            return server, await asyncio.wait_for(process.wait(), 60)

    with ThreadPoolExecutor(1) as thread:
        server, code = thread.submit(asyncio.run, run()).result()
    (hello,) = server.of(wire.Hello)
    assert (hello.name, hello.device, hello.joint_set, code) == ("marionette", "a marionette", "canonical", 0)


def test_a_camera_that_gives_depth(example):
    wall = example("wall").Wall()
    tracked = studio.open_source(wall)
    assert tracked.intrinsics is not None and tracked.joint_set == "canonical"
    ((_, depth_mm),) = take(wall, 1)
    assert depth_mm.shape == (wall.camera.height, wall.camera.width)


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
    monkeypatch.setattr(settings, "SWITCHES", dict(settings.SWITCHES))
    registration("add_filter", add_filter=filters.add_filter, MeanOfTwo=MeanOfTwo)
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

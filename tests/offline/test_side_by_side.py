"""Cameras tracked in processes side by side: the same skeletons, and nothing remains when the work is stopped."""

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from studio import worker
from studio.engine.base.errors import StudioError
from studio.engine.base.system import core_count
from studio.engine.model.settings.settings import SolveSettings, preset
from studio.engine.seeing.tracker.skeletons import per_camera
from studio.offline import side_by_side
from studio.offline.replay import solve_take
from studio.offline.side_by_side import track_cameras
from studio.simulator.body.performers import TUNING
from studio.take.folder.take import Take
from studio.take.raw.depth import DepthRecording
from studio.worker import Stopped, run_in_process
from tests.engine.seeing.cameras.given_cameras import watched
from tests.engine.seeing.cameras.hands_at_body import short_washing
from tests.offline.depth_takes import depth_take

CAMERAS = ("camera_0", "camera_1")
SECONDS, WORTH_IMAGES = 1.0, 60


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Take:
    """What two cameras see for a second."""
    scene = watched(TUNING[0], short_washing(TUNING[0]), seconds=SECONDS)
    return depth_take(tmp_path_factory.mktemp("depth") / "t", scene)


@pytest.fixture(autouse=True)
def worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few images are worth several processes here, so that little is tracked."""
    monkeypatch.setattr(side_by_side, "WORTH_IMAGES", WORTH_IMAGES)


@pytest.fixture(autouse=True)
def others() -> Iterator[None]:
    """Processes that were ready before do not count as the test's."""
    _OTHERS[:] = psutil.Process().children(recursive=True)
    yield


_OTHERS: list[psutil.Process] = []


def children() -> list[psutil.Process]:
    """Processes of work that the test started."""
    found = [child for child in psutil.Process().children(recursive=True) if child not in _OTHERS]
    return [child for child in found if _is_work(child)]


def _is_work(process: psutil.Process) -> bool:
    try:
        parent = process.parent()
        copied = parent is not None and "multiprocessing.forkserver" in " ".join(parent.cmdline())
        return copied or "multiprocessing.spawn" in " ".join(process.cmdline())
    except psutil.NoSuchProcess:  # it has ended meanwhile
        return False


def test_processes_give_the_same_skeletons_as_one(take: Take) -> None:
    recording, shares = DepthRecording(take.raw_path), []
    assert sum(len(recording.times_ns(name)) for name in CAMERAS) >= side_by_side.WORTH_IMAGES
    several = track_cameras(take, recording, CAMERAS, shares.append, processes=2)
    one = track_cameras(take, recording, CAMERAS, processes=1)
    both = list(per_camera(recording.frames(), recording.cameras))
    assert tuple(several) == tuple(one) == CAMERAS and not children()
    assert shares == sorted(shares) and 0.0 <= shares[0] and shares[-1] <= 1.0
    for name in CAMERAS:
        frames = [frame for frame in both if frame.camera == name]
        assert len(frames) == len(one[name]) == len(several[name])
        for a, b, c in zip(frames, one[name], several[name], strict=True):
            assert a.device_time_ns == b.device_time_ns == c.device_time_ns
            for other in (b, c):
                assert np.array_equal(a.positions, other.positions, equal_nan=True)
                assert np.array_equal(a.confidence, other.confidence)


def test_whoever_stops_it_stops_all_processes(take: Take) -> None:
    def stop(share: float) -> None:
        if share > 0.0:
            raise Stopped("enough")

    with pytest.raises(Stopped, match="enough"):
        track_cameras(take, DepthRecording(take.raw_path), CAMERAS, stop, processes=2)
    assert not children() and not (take.path / "tracked").exists()


def test_a_process_that_was_killed_is_told_with_what_to_do(take: Take) -> None:
    def kill(share: float) -> None:
        if share > 0.0 and children():
            children()[0].kill()

    with pytest.raises(StudioError, match=r"track_camera broke off \(exit code -9\); try again"):
        track_cameras(take, DepthRecording(take.raw_path), CAMERAS, kill, processes=2)
    assert not children()


def solve_take_of_few(take: Take, settings: SolveSettings, **options: Any) -> Path:
    """Solve a take in whose process few images are worth several, too."""
    side_by_side.WORTH_IMAGES = WORTH_IMAGES
    return solve_take(take, settings, **options)


def test_a_solve_in_the_server_s_process_tracks_side_by_side(
    take: Take, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_TEXT", re.compile(rf"{re.escape(__name__)}:\w+"))
    counts, settings = [], replace(preset("studio"), tracker="per_camera")
    run_in_process(
        f"{__name__}:solve_take_of_few",
        take,
        settings,
        name="apart",
        on_progress=lambda share: counts.append(len(children())),
        spare=False,
    )
    assert max(counts) == (3 if core_count() > 1 else 1) and not children()
    assert sorted(path.name for path in (take.path / "tracked").iterdir()) == [
        f"camera-{n}.npz" for n in CAMERAS
    ]
    shutil.rmtree(take.path / "tracked")

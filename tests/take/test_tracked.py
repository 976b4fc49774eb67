"""Skeletons from depth are made once: later solves and previews find them in the take."""

import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.offline import tracking
from studio.offline.preview import solve_part
from studio.offline.replay import solve_take
from studio.simulator.rig import standard_rig
from studio.simulator.simulate import simulate_take
from studio.take.folder import tracked
from studio.take.folder.take import Take
from studio.take.folder.tracked import FOLDER
from studio.take.library.bundle import write_bundle
from studio.take.raw.frames import RawWriter
from studio.take.raw.index import indexed_topics
from studio.take.raw.kept_frames import several_bodies
from studio.take.upkeep.doctor import check_take
from studio.wire import encode
from tests.engine.walkers import performer
from tests.live.performer import frame, hello
from tests.refused import refused
from tests.simulator.depth.test_take import motion

__all__ = ["motion"]


@pytest.fixture(scope="module")
def simulated(motion: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a take of depth alone, 0.8 s of two cameras, calibrated."""
    path = tmp_path_factory.mktemp("simulated") / "t"
    simulate_take(motion, path, tracker="depth", sensor="azure-kinect", calibration=False, cameras=2, seed=4)
    cameras = {camera.name: CameraCalibration(camera.T_stage_camera) for camera in standard_rig(2)}
    Take.open(path).add_calibration(Calibration("camera_0", cameras, performer()), use=True)
    return path


@pytest.fixture
def take(simulated: Path, tmp_path: Path) -> Take:
    """A copy of the take, without what was tracked."""
    shutil.copytree(simulated, tmp_path / "t")
    return Take.open(tmp_path / "t")


def solved(take: Take, **switches: str) -> bytes:
    folder = solve_take(take, SolveSettings(**switches), name="studio")
    return Poses.load(folder / "poses.npz").positions_m.tobytes()


def solved_as_placed(take: Take) -> bytes:
    """The take solved from its points, with cameras as they are given: it is tracked once, not once more for them."""
    return solved(take, tracker="points", refine_cameras="off")


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Which trackers run."""
    runs: list[str] = []
    for name in ("track_cameras", "from_points"):
        made = getattr(tracking, name)
        monkeypatch.setattr(
            tracking, name, lambda *a, name=name, made=made, **k: runs.append(name) or made(*a, **k)
        )
    return runs


def test_a_take_is_tracked_once_and_its_solves_stay_the_same(take: Take, counted: list[str]) -> None:
    with refused(TakeError, "depth.not_tracked"):
        solve_part(take, SolveSettings(), 0.3, 0.6)
    for switches in ({"tracker": "points"}, {"tracker": "client"}):
        fresh = solved(take, **switches)
        assert solved(take, **switches) == fresh
        assert solve_part(take, SolveSettings(**switches), 0.3, 0.6).frame_count > 10
    assert solved(take, tracker="per_camera", cameras="camera_1") != fresh
    assert counted == ["from_points", "track_cameras"]


def test_another_raw_file_is_looked_at_anew(take: Take) -> None:
    settings = SolveSettings()
    was = tracking.is_tracked(take, settings)
    with RawWriter(take.path / "other.mcap") as writer:
        writer.add_camera(hello("camera_0"))
        writer.frame("camera_0", encode(frame(0, 0, 0, 0.0)), arrival_ns=0, device_time_ns=0, sequence=0)
    (take.path / "other.mcap").replace(take.raw_path)
    assert was and not tracking.is_tracked(take, settings)


def test_a_raw_file_without_its_index_is_read(take: Take) -> None:
    settings = SolveSettings()
    was = tracking.is_tracked(take, settings)
    take.raw_path.write_bytes(take.raw_path.read_bytes()[:-8])
    assert indexed_topics(take.raw_path) is None
    assert was and tracking.is_tracked(take, settings)


def test_what_was_tracked_with_other_frames_transforms_or_code_is_tracked_again(
    take: Take, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    fresh = solved_as_placed(take)
    calibration = take.calibration()
    moved = calibration.cameras["camera_1"].T_stage_camera.copy()
    moved[0, 3] += 0.05
    cameras = calibration.cameras | {
        "camera_1": replace(calibration.cameras["camera_1"], T_stage_camera=moved)
    }
    take.add_calibration(replace(calibration, cameras=cameras), use=True)
    assert solved_as_placed(take) != fresh
    os.utime(take.raw_path, ns=(1, 1))
    solved_as_placed(take)
    monkeypatch.setattr(tracked, "code_digest", lambda *folders: "another")
    solved_as_placed(take)
    assert len(counted) == 4
    (file,) = (take.path / FOLDER).glob("*.npz")
    file.write_bytes(file.read_bytes()[:1000])
    solved_as_placed(take)
    assert len(counted) == 5


def test_a_full_disk_costs_the_next_solve_its_time_and_nothing_else(
    take: Take, counted: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(path: Path) -> None:
        raise StudioError(f"cannot write {path}: no space")

    monkeypatch.setattr(tracked, "write_atomically", full)
    fresh = solved_as_placed(take)
    assert "no space" in caplog.text
    assert solved_as_placed(take) == fresh and len(counted) == 2


def test_it_is_neither_damage_nor_part_of_a_bundle(take: Take, tmp_path: Path) -> None:
    solved_as_placed(take)
    (take.path / FOLDER / ".points.npz.abc").write_bytes(b"half")
    (left,) = check_take(take.path)
    assert left.path.name == ".points.npz.abc" and not left.path.exists()
    assert check_take(take.path) == []
    without = write_bundle(take, tmp_path / "a.take.zip")
    for file in (take.path / FOLDER).iterdir():
        file.write_bytes(np.random.default_rng(1).bytes(4 << 20))
    assert write_bundle(take, tmp_path / "b.take.zip") == without


def test_several_bodies_of_a_frame_are_kept_together(take: Take) -> None:
    rng = np.random.default_rng(0)

    def body(sequence: int, number: int) -> CameraFrame:
        return CameraFrame("a", sequence, sequence * 7, rng.random((21, 3)), rng.random(21), body=number)

    frames = [body(0, 0), replace(body(1, 0), others=(body(1, 1), body(1, 3))), body(2, 3)]
    tracked.keep_tracked(take, "a", tracked.Tracked(frames))
    kept = tracked.read_tracked(take, "a")
    assert kept is not None and len(kept.frames) == 3
    for before, after in zip(frames, kept.frames, strict=True):
        for one, other in zip(before.bodies(), after.bodies(), strict=True):
            assert (one.body, one.sequence, one.device_time_ns) == (
                other.body,
                other.sequence,
                other.device_time_ns,
            )
            np.testing.assert_array_equal(one.positions, other.positions)
    assert several_bodies({"a": kept.frames}) and not several_bodies({"a": kept.frames[:1]})

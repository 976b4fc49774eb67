"""The first seconds of a depth take are shown while the rest is tracked, which changes nothing of the solve."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings, preset
from studio.engine.seeing.fitting.cones import performer_of
from studio.engine.seeing.search.start import shape_of_height
from studio.offline import first_seconds
from studio.offline.first_seconds import FirstSeconds
from studio.offline.replay import solve_take
from studio.offline.so_far import SoFar
from studio.simulator.body.performers import TUNING
from tests.engine.seeing.cameras.given_cameras import watched
from tests.engine.seeing.cameras.hands_at_body import short_washing
from tests.offline.depth_takes import depth_take

SECONDS, PART_S, HZ = 1.4, 0.6, 15.0
PERFORMER = performer_of(shape_of_height(1.75))


def test_parts_come_before_the_solve_and_change_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_seconds, "PART_S", PART_S)
    scene = watched(TUNING[0], short_washing(TUNING[0]), seconds=SECONDS, hz=HZ)
    take = depth_take(tmp_path / "t", scene)
    parts: list[SoFar] = []
    told: list[tuple[int, float]] = []
    settings = replace(preset("finish"), physics="off")
    solve_take(
        take,
        settings,
        name="shown",
        show=parts.append,
        progress=lambda share: told.append((len(parts), share)),
    )
    assert [part.begins for part in parts] == [True, True, False]  # with cameras as given, refined, and on
    assert all(share < 1.0 for count, share in told if count < 3)
    solved = Poses.load(take.solve_folder("shown") / "poses.npz")
    for part in parts:
        assert abs(part.of_s - SECONDS) < 0.2
    assert PART_S - 0.2 < parts[0].until_s < PART_S + 0.2 and parts[2].until_s > 2 * PART_S - 0.2
    times_s = np.concatenate([part.poses.time_s for part in parts[1:]])
    assert (np.diff(times_s) > 0).all() and np.diff(times_s).max() < 0.02
    near = np.searchsorted(solved.time_s, times_s)
    apart_m = np.linalg.norm(
        np.concatenate([part.poses.positions_m for part in parts[1:]])[:, 0] - solved.positions_m[near, 0],
        axis=1,
    )
    assert np.median(apart_m) < 0.03
    shutil.rmtree(take.path / "tracked")
    solve_take(take, settings, name="silent")
    silent = Poses.load(take.solve_folder("silent") / "poses.npz")
    assert np.array_equal(silent.positions_m, solved.positions_m)
    parts.clear()
    solve_take(
        take, settings, name="again", show=parts.append
    )  # tracked before: there is nothing to wait for
    assert not parts


def test_no_beginning_is_shown_of_what_begins_later() -> None:
    """Of a long take, cameras are refined on parts; one in its middle is not its beginning."""
    calibration = Calibration("points", {"points": CameraCalibration(np.eye(4))}, None)
    parts: list[SoFar] = []
    first = FirstSeconds(calibration, SolveSettings(), (0, 90 * 10**9), parts.append)
    for k in range(200):
        frame = CameraFrame("points", k, 60 * 10**9 + k * 33_333_333, np.zeros((21, 3)), np.ones(21))
        first.take(frame, PERFORMER)
    assert not parts

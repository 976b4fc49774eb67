"""A solve refines cameras that were given before it tracks depth, says so, and can be told not to."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.settings.settings import PRESETS, SolveSettings
from studio.engine.seeing.cameras import refine
from studio.offline.placing import refines, windows
from studio.offline.preview import solve_part
from studio.offline.replay import solve_take
from studio.simulator.body.performers import TUNING
from studio.take.folder.solves import read_metrics
from studio.take.folder.take import Take
from tests.engine.seeing.cameras.given_cameras import a_little_off, apart_m, watched
from tests.engine.seeing.cameras.hands_at_body import short_washing
from tests.offline.depth_takes import depth_take

SECONDS, BRIEF_S, HZ = 2.4, 0.5, 15.0
CAMERAS = ("camera_0", "camera_1")

LOOKED_AT_HZ = 5.0
"""Rate at which images of cameras of 30 Hz are used to place them [Hz]; these have the same."""


@pytest.fixture(scope="module")
def scene():
    """The T-pose and the beginning of the next movement, before two Kinect v2."""
    return watched(TUNING[0], short_washing(TUNING[0]), seconds=SECONDS, hz=HZ)


@pytest.fixture
def take(scene, tmp_path: Path) -> Take:
    """The same as a take, with cameras as boards give them."""
    return depth_take(tmp_path / "t", scene)


def test_a_solve_tells_how_far_cameras_were_moved(
    scene,
    take: Take,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(refine, "EVERY", round(HZ / LOOKED_AT_HZ))
    with caplog.at_level(logging.INFO):
        metrics = read_metrics(solve_take(take, SolveSettings(), name="refined")) or {}
    moved = metrics["cameras_moved"]
    assert tuple(moved) == CAMERAS and metrics["refined_cameras"] in caplog.text
    for name in CAMERAS:
        assert (
            f"{name} by {moved[name]['moved_mm']:.1f} mm and {moved[name]['turned_deg']:.2f} degrees"
            in (metrics["refined_cameras"])
        )
    placed = {name: np.array(moved[name]["T_stage_camera"]) for name in CAMERAS}
    assert apart_m(placed, scene.placed) < 0.6 * apart_m(a_little_off(scene.placed, 3), scene.placed)
    again = read_metrics(solve_take(take, SolveSettings(), name="again")) or {}
    assert again["cameras_moved"] == moved
    assert solve_part(take, SolveSettings(), 0.5, 1.0).frame_count > 10
    assert take.calibration().given  # the calibration itself stays as it was given
    brief = depth_take(tmp_path / "brief", replace(scene, sets=scene.sets[: round(BRIEF_S * HZ)]))
    off = read_metrics(solve_take(brief, SolveSettings(refine_cameras="off"), name="off")) or {}
    assert "cameras_moved" not in off and "refined_cameras" not in off


def test_only_given_cameras_are_refined_unless_all_are_wanted() -> None:
    given = Calibration("a", {name: CameraCalibration(np.eye(4)) for name in "ab"})
    cameras = {name: replace(camera, residual_median_mm=8.0) for name, camera in given.cameras.items()}
    walked = replace(given, cameras=cameras)
    assert given.given and not walked.given
    for value, expected in (("off", (False, False)), ("given", (True, False)), ("all", (True, True))):
        settings = SolveSettings(refine_cameras=value)
        assert tuple(refines(settings, one, ("a", "b")) for one in (given, walked)) == expected
        assert not refines(settings, given, ("a",))
        assert not refines(replace(settings, tracker="per_camera"), given, ("a", "b"))
    assert [PRESETS[name].refine_cameras for name in ("raw", "thesis", "studio", "finish")] == [
        "off", "off", "given", "given",
    ]  # fmt: skip


def test_long_takes_are_looked_at_in_parts() -> None:
    assert windows(5, 10**10) == [(5, 10**10)]
    parts = windows(0, 600 * 10**9)
    assert [begin for begin, _ in parts] == [0, 198_666_666_666, 397_333_333_333, 596 * 10**9]
    assert all(end - begin == 4 * 10**9 for begin, end in parts)

"""The page exports the motion of a robot that follows a solve, and a prop of the take."""

from pathlib import Path

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.engine.model.poses import on_output_joints
from studio.engine.model.settings.settings import preset
from studio.engine.rigid_bodies.tracks import BodyTrack, BodyTracks
from studio.engine.robots.files import FOLDER, add_robot
from studio.take.folder.solves import write_solve
from studio.take.rigid_bodies.kept import save_tracks
from tests.engine.robots import models
from tests.web.playback.takes import take_of_two, take_with_solves
from tests.web.test_page import serving, studio

FRAMES = 31


@pytest.fixture
def sessions(tmp_path: Path, test_data: Path) -> Path:
    """A take of a quarter of a second of a walk with a stick that lay beside, and a kept robot."""
    add_robot(tmp_path / FOLDER, models.written(tmp_path, models.child()), "child")
    take = take_with_solves(tmp_path / "monday" / "walk", picture=True)
    poses = frames_of(imported_poses(test_data / "mocap" / "02_03.bvh")[0], slice(0, FRAMES))
    write_solve(
        take, "walk", settings=preset("studio"), poses=on_output_joints(poses), metrics={}, trace=None
    )
    lay = BodyTrack(
        poses.time_s, np.tile([1.0, 0.0, 0.1], (FRAMES, 1)), np.tile([1.0, 0.0, 0.0, 0.0], (FRAMES, 1))
    )
    save_tracks(take, BodyTracks({"Stick": lay}, frozenset({"Stick"})))
    return tmp_path


@pytest.mark.browser
def test_a_robot_s_motion_and_a_prop_are_exported(sessions: Path, page: Page, tmp_path: Path) -> None:
    with studio(sessions) as (app, _), serving(app) as url:
        page.goto(url)
        page.get_by_role("button", name="Export walk, solve walk").click()
        page.locator("#export-what").select_option(label="robot child, which follows")
        expect(page.locator(".recipes")).to_be_hidden()
        assert page.locator("#export-format").input_value() == "csv"
        page.locator("#export-balance").check()
        with page.expect_download() as robot:
            page.locator("#export-run").click()
        assert robot.value.suggested_filename == "walk_walk_child.csv"
        rows = np.loadtxt(robot.value.path(), delimiter=",")
        assert len(rows) == FRAMES and np.allclose(np.linalg.norm(rows[:, 3:7], axis=1), 1.0, atol=1e-5)

        page.get_by_role("button", name="Export walk, solve walk").click()
        page.locator("#export-what").select_option(label="prop Stick")
        page.locator("#export-format").select_option("bvh")
        with page.expect_download() as prop:
            page.locator("#export-run").click()
        assert prop.value.suggested_filename == "walk_walk_Stick.bvh"
        assert f"Frames: {FRAMES}" in prop.value.path().read_text()


def test_a_robot_s_file_has_the_name_of_its_performer(tmp_path: Path) -> None:
    add_robot(tmp_path / FOLDER, models.written(tmp_path, models.child()), "child")
    take_of_two(tmp_path / "monday" / "two")
    wanted = {"take": "monday/two", "solve": "studio", "robot": "child", "end_s": 0.2}
    with (
        studio(tmp_path) as (app, _),
        serving(app) as url,
        httpx.Client(base_url=url, timeout=60.0) as client,
    ):
        names = [
            client.post("/api/v1/exports/robot", json={**wanted, "performer": one}).json()["name"]
            for one in (None, "performer_1", "performer_2")
        ]
    assert names == [f"two_studio_child{end}" for end in (".zip", "-performer_1.csv", "-performer_2.csv")]

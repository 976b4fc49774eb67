"""Rigid bodies of a recorded take on the page: what each is, measured against the solve, and shown in its replay."""

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.rigid_bodies.known import TakeBodies
from studio.engine.rigid_bodies.tracks import BodyTrack, BodyTracks
from studio.take.rigid_bodies.kept import save_take_bodies, save_tracks, take_bodies
from tests import poses_factory
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser
OFFSET_M = np.array([0.0, 0.05, 0.1])


def test_bodies_of_a_take_are_named_and_measured(tmp_path: Path, page: Page) -> None:
    take = take_with_solves(tmp_path / "monday" / "one")
    poses = poses_factory.random_poses(np.random.default_rng(0), seconds=2.0)
    head = poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX[INDEX["head"]]]
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(head), 1))
    tracks = {
        "Cap": BodyTrack(poses.time_s, head - OFFSET_M, still),
        "Wand": BodyTrack(poses.time_s, head + 0.5, still),
    }
    save_tracks(take, BodyTracks(tracks))
    save_take_bodies(take, TakeBodies())
    with studio(tmp_path) as (app, _), serving(app) as url:
        page.goto(url)
        page.get_by_role("button", name="Replay one, solve studio").first.click()
        panel = page.locator("#bodies-panel")
        expect(panel).to_contain_text("121 readings")
        panel.get_by_label("Use of Wand").select_option("prop")
        until(lambda: take_bodies(take).named("Wand"))
        panel.get_by_label("Shape of Wand").fill("cylinder:3,60")
        panel.get_by_label("Shape of Wand").press("Enter")
        until(lambda: (known := take_bodies(take).named("Wand")) and known.shape)
        panel.get_by_label("Joint of Cap").select_option("head")
        panel.get_by_label("Use of Cap").select_option("evidence")
        expect(panel).to_contain_text("it holds nothing")
        page.locator("#bodies-measure").click()
        expect(panel).to_contain_text("pins head in further solves; measured to 0 mm")
        assert set(take_bodies(take).ties) == {"Cap"}
        panel.get_by_label("Use of Wand").select_option("")
        until(lambda: take_bodies(take).named("Wand") is None)

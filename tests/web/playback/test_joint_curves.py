"""Curves of several joints: their values, their thinning, and how the page draws and names them."""

import itertools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from studio.engine.animation.clip.clip import clip as clipped
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.curves.euler import from_euler
from studio.engine.base.errors import SettingsError
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import INDEX, OUTPUT_INDEX, OUTPUT_JOINTS
from studio.web.playback.clip import Clip
from studio.web.playback.joint_curves import MAX_CURVES, CurveColumns
from studio.web.playback.second import Second
from tests import patient
from tests.web.browser import until
from tests.web.playback.takes import FRAMES, take_with_solves
from tests.web.test_page import serving, studio

STYLES = Path(__file__).parents[3] / "studio" / "web" / "static" / "replay" / "replay.css"


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A clip with a trace of two cameras."""
    return Clip.load(take_with_solves(tmp_path_factory.mktemp("sessions") / "monday" / "one"), "studio")


def test_values_are_those_of_exported_files(shown: Clip) -> None:
    """Position in file axes, and the local rotation of the joint, as a clip that is exported has them."""
    wanted = [f"LeftHand.{kind}_{axis}" for kind in ("position", "rotation") for axis in "xyz"]
    found = CurveColumns().curves(shown, wanted)
    assert (found.first, found.last, found.whole) == (0, FRAMES - 1, True)
    place = np.array([curve.values for curve in found.curves[:3]]).T
    stage = shown.poses.positions_m[:, OUTPUT_INDEX["LeftHand"]]
    assert place == pytest.approx(np.stack([stage[:, 0], stage[:, 2], -stage[:, 1]], axis=1), abs=1e-4)
    motion = clipped(shown.poses, ExportOptions())
    local = motion.rotations_wxyz[:, motion.joint_names.index("LeftHand")]
    angles, order = np.array([curve.values for curve in found.curves[3:]]).T, found.curves[3].order
    turned = from_euler(angles, order[::-1])
    assert np.abs(np.sum(turned * local, axis=1)) == pytest.approx(1.0, abs=1e-6)
    assert {curve.unit for curve in found.curves} == {"m", "deg"}


def test_parts_are_finer_and_no_spike_is_lost(shown: Clip) -> None:
    frames, columns = 30_000, CurveColumns()
    again = {
        name: np.concatenate([getattr(shown.poses, name)] * (frames // FRAMES + 1))[:frames]
        for name in ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    }
    again["positions_m"][12_345, OUTPUT_INDEX["Head"], 2] = 9.0
    poses = replace(shown.poses, time_s=np.arange(frames) / 60.0, **again)
    long = replace(shown, poses=poses, trace=None)
    (whole,) = columns.curves(long, ["Head.position_y"], points=2000).curves
    assert 1500 < len(whole.frames) <= 2100
    assert whole.values[whole.frames.index(12_345)] == 9.0
    part = columns.curves(long, ["Head.position_y"], first=12_000, last=13_000, points=2000)
    assert part.whole and part.curves[0].frames == list(range(12_000, 13_001))
    (one,) = columns.curves(long, ["Head.position_y"], first=7, last=7).curves
    assert (one.frames, len(one.values)) == ([7], 1)


def test_frames_in_which_no_camera_was_used_are_told(shown: Clip) -> None:
    trace = shown.trace
    assert trace is not None
    used = trace.used.copy()
    used[10:20] = False
    used[30:40, 0] = False  # the other camera was
    blind = replace(shown, trace=replace(trace, used=used))
    wanted = ["LeftHand.speed", "LeftHandIndex2.rotation_z"]
    for curve in CurveColumns().curves(blind, wanted).curves:
        assert curve.unseen == [(10, 19)], curve.joint


def test_distances_are_to_the_second_figure(shown: Clip) -> None:
    columns, wanted = CurveColumns(), ["LeftHand.distance", "LeftHandThumb1.distance"]
    assert columns.curves(shown, wanted).curves == []
    moved = replace(shown.poses, positions_m=shown.poses.positions_m + np.array([0.03, 0.0, 0.04]))
    beside = Second.solve(replace(shown, solve="moved", poses=moved), shown)
    both = columns.curves(shown, wanted, beside=(beside, 0.0)).curves
    assert [set(curve.values) for curve in both] == [{50.0}, {50.0}]
    joints = canonical_positions(shown.poses).copy()
    joints[40:50, INDEX["left_wrist"]] = np.nan
    reference = Second.reference("monday/one", "truth.csv", Reference(shown.poses.time_s, joints))
    hand, thumb = columns.curves(shown, wanted, beside=(reference, 0.0)).curves
    known = [value for value in hand.values if value is not None]
    assert set(thumb.values) == {None} and max(known) < 0.1, "a reference has no thumb of this name"
    assert hand.values[41:49] == [None] * 8
    (late,) = columns.curves(shown, wanted[:1], beside=(beside, 0.5)).curves
    assert max(value for value in late.values if value is not None) > 50.0


def test_what_there_is_not_is_refused(shown: Clip) -> None:
    columns = CurveColumns()
    for wanted, says in ((["Tail.speed"], "LeftHand"), (["Head.colour"], "rotation_x")):
        with pytest.raises(SettingsError, match=says):
            columns.curves(shown, wanted)
    with pytest.raises(SettingsError, match=f"{MAX_CURVES} at most"):
        columns.curves(shown, [f"{joint}.speed" for joint in OUTPUT_JOINTS[: MAX_CURVES + 1]])
    with pytest.raises(SettingsError, match="no range"):
        columns.curves(shown, ["Head.speed"], first=FRAMES + 4)


_SEEN = {  # linear RGB as it is seen; of people who lack a kind of cone: Machado et al. 2009, severity 1
    "all": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "protan": [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]],
    "deutan": [[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]],
    "tritan": [[1.2555, -0.0767, -0.1788], [-0.0784, 0.9308, 0.1476], [0.0047, 0.6914, 0.3039]],
}


def _linear(colour: str) -> np.ndarray:
    rgb = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def _oklab(linear: np.ndarray) -> np.ndarray:
    """Ottosson 2020: a space in which distances are as people see them."""
    to_lms = [[0.4122, 0.5363, 0.0514], [0.2119, 0.6807, 0.1074], [0.0883, 0.2817, 0.6300]]
    to_lab = [[0.2105, 0.7936, -0.0041], [1.9780, -2.4286, 0.4506], [0.0259, 0.7828, -0.8087]]
    return np.array(to_lab) @ np.cbrt(np.clip(np.array(to_lms) @ linear, 0.0, None))


@pytest.mark.parametrize(("theme", "ground"), [(0, "#20262d"), (1, "#e4ebf3")])
def test_colours_are_told_apart_also_by_who_sees_fewer(theme: int, ground: str) -> None:
    rule = [line for line in STYLES.read_text().splitlines() if "--curve-0:" in line][theme]
    colours = [_linear(found) for found in re.findall(r"--curve-\d: (#\w{6})", rule)]
    assert len(colours) == 6
    light = np.array([0.2126, 0.7152, 0.0722])
    for colour in colours:
        low, high = sorted([light @ colour, light @ _linear(ground)])
        assert (high + 0.05) / (low + 0.05) >= 3.0, "as WCAG asks of graphics"
    for sight, seen in _SEEN.items():
        for one, other in itertools.combinations(colours, 2):
            assert np.linalg.norm(_oklab(np.array(seen) @ one) - _oklab(np.array(seen) @ other)) > 0.09, sight


@pytest.mark.browser
def test_several_curves_are_chosen_read_and_removed(tmp_path: Path, page: Page) -> None:
    take_with_solves(tmp_path / "monday" / "one")
    with studio(tmp_path) as (app, _), serving(app) as url:
        page.goto(url)
        page.get_by_role("button", name="Replay one, solve studio").click()
        expect(page.locator("#replay-value")).to_contain_text("m")
        page.keyboard.press("c")
        expect(page.locator("#curve-search")).to_be_focused()
        page.keyboard.type("left hand")
        expect(page.locator("#curve-table tbody tr:visible")).to_have_count(16)
        page.locator("#curve-LeftHand-position_x").focus()
        page.keyboard.press("Space")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Space")
        expect(page.locator("#replay-time")).to_contain_text(f" 0 / {FRAMES - 1}")  # arrows did not step
        page.locator("#curve-search").fill("head")
        page.locator("#curve-Head-rotation_z").check()
        page.locator("#curve-Head-speed").check()
        assert page.locator("#curve-Head-distance").is_disabled()
        page.keyboard.press("Escape")
        expect(page.locator("#curve-list")).to_be_hidden()
        expect(page.locator("#replay")).to_be_visible()
        legend = page.locator("#curve-legend li")
        expect(legend).to_have_count(4)
        page.keyboard.press("End")
        params = {"curve": ["LeftHand.position_y", "Head.rotation_z"]}
        said = patient.get(f"{url}/api/v1/replay/joint_curves", params=params).json()["curves"]
        expect(legend.nth(1)).to_contain_text(f"LeftHand Position Y{said[0]['values'][-1]:.3f} m")
        expect(legend.nth(2)).to_contain_text(f"Head Rotation Z{said[1]['values'][-1]:.1f}°")
        box = page.locator("#timeline").bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + 96, box["y"] + 60)
        expect(page.locator("#timeline-tip")).to_contain_text(
            f"LeftHand Position Y {said[0]['values'][0]:.3f} m"
        )
        page.reload()
        expect(legend).to_have_count(4)  # this tab's
        drawn = page.locator("#timeline").evaluate("canvas => canvas.toDataURL()")
        page.get_by_role("button", name="Remove Head, Speed").click()
        expect(legend).to_have_count(3)
        until(page, f"document.querySelector('#timeline').toDataURL() !== {drawn!r}")
        page.keyboard.press("c")
        page.locator("#curve-clear").click()
        expect(page.locator("#curve-legend")).to_be_hidden()
        expect(page.locator("#replay-value")).to_be_visible()
        page.mouse.click(300, 150)  # into the view
        expect(page.locator("#curve-list")).to_be_hidden()


@pytest.mark.browser
def test_a_long_take_is_read_exactly(tmp_path: Path, page: Page) -> None:
    """What is thinned says that it is about so much until the frame under the playhead is known."""
    from studio.engine.model.settings.settings import preset
    from studio.take.folder.solves import write_solve

    take = take_with_solves(tmp_path / "monday" / "one")
    poses = Clip.load(take, "studio").poses
    many = 60
    long = {
        name: np.concatenate([getattr(poses, name)] * many)
        for name in ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    }
    frames = many * FRAMES
    long["positions_m"][:, 0, 2] += np.random.default_rng(0).normal(0.0, 0.2, frames)
    write_solve(
        take, "long", settings=preset("studio"), metrics={},
        poses=replace(poses, time_s=np.arange(frames) / 60.0, **long),
    )  # fmt: skip
    with studio(tmp_path) as (app, _), serving(app) as url:
        page.add_init_script(
            'sessionStorage.setItem("curves", JSON.stringify([{joint: "Hips", channel: "position_y", slot: 0}]))'
        )
        page.goto(url)
        page.get_by_role("button", name="Replay one, solve long").click()
        value = page.locator("#curve-value-Hips-position_y")
        expect(value).to_contain_text("m")
        for frame in (1, 2, 3):
            page.keyboard.press("ArrowRight")
            truth = long["positions_m"][frame, 0, 2]
            expect(value).to_have_text(f"{truth:.3f} m")
        for _ in range(40):
            page.keyboard.press("+")
        box = page.locator("#timeline").bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + 97, box["y"] + 60)
        first = int(page.locator("#timeline-tip strong").inner_text().split()[-1])
        page.mouse.move(box["x"] + 98, box["y"] + 60)
        expect(page.locator("#timeline-tip")).to_contain_text(f"Y {long['positions_m'][first, 0, 2]:.3f} m")

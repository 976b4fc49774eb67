"""One take's figures and times on the page, in the report, over the API and on the command line: the same everywhere.

The take has a calibration part of 34 s, so that stage time and the time that people read differ.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.joints import CANONICAL, OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from tests import patient
from tests.commands.program import studio as command
from tests.poses_factory import make_poses
from tests.web.playback.takes import add_picture
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser

CALIBRATION_S = 34.0
ROWS = {
    # key: words on the page, in the report, on the command line
    "mpjpe_mm": ("Mean error [mm]", "joint error, mm", "MPJPE mm"),
    "mpjpe_root_aligned_mm": ("… hips on hips [mm]", "joint error from the hips, mm", "rooted mm"),
    "joint_angle_error_deg": ("Joint angles [°]", "joint angles, degrees", "joint angles deg"),
    "acceleration_error_m_s2": ("Acceleration error [m/s²]", "acceleration error, m/s2", "accel m/s2"),
    "absolute_difference_cm": ("Wrist difference [cm]", "absolute difference, cm", "abs.diff cm"),
    "shortest_distance_cm": ("Wrist path distance [cm]", "shortest distance, cm", "shortest cm"),
    "jerk_m_s3": ("Jerk where the reference is known [m/s³]", "jerk, m/s3", "jerk m/s3"),
    "foot_slide_cm_s": (
        "Foot slide in the reference's stance [cm/s]",
        "foot slide in the reference's stance, cm/s",
        "slide in reference's stance cm/s",
    ),
    "own_stance_foot_slide_cm_s": (
        "Foot slide in its own stance [cm/s]",
        "foot slide in its own stance, cm/s",
        "slide in its own stance cm/s",
    ),
    "bone_length_sd_mm": ("Bone length spread [mm]", "spread of bones, mm", "bones mm"),
    "cleanup_events_per_min": (
        "Clean-up events against the reference [/min]",
        "clean-up events a minute, against the reference",
        "clean-up against reference /min",
    ),
}
OF_ONE_SOLVE = {
    "Jitter [mm]", "Jerk [m/s³]", "Foot slide in its own stance [cm/s]", "Bone length spread [mm]",
    "Clean-up events by itself [/min]",
}  # fmt: skip


def performance() -> Poses:
    """Four seconds of an arm that swings over feet that stand, from 34 s of stage time on."""
    frames = 240
    angle = np.radians(40.0) * np.sin(2 * np.pi * np.arange(frames) / 60.0)
    local = np.zeros((frames, 52, 4))
    local[..., 0] = 1.0
    arm = OUTPUT_INDEX["LeftArm"]
    local[:, arm, 0], local[:, arm, 2] = np.cos(angle / 2), np.sin(angle / 2)
    root = np.tile([0.0, 0.0, 0.94], (frames, 1))
    root[:, 0] += 0.005 * np.sin(2 * np.pi * np.arange(frames) / 90.0)
    poses = make_poses(local, root_m=root)
    return replace(poses, time_s=poses.time_s + CALIBRATION_S)


def solved(truth: Poses) -> Poses:
    """The same with noise, an elbow that is thrown off 2 s after the beginning, and feet that slide."""
    rng = np.random.default_rng(5)
    positions = truth.positions_m + rng.normal(0.0, 0.004, truth.positions_m.shape)
    slide = 0.03 * np.sin(2 * np.pi * (truth.time_s - CALIBRATION_S))
    feet = [OUTPUT_INDEX[f"{side}{name}"] for side in ("Left", "Right") for name in ("Foot", "ToeBase")]
    positions[:, feet, 0] += slide[:, None]
    rotations = truth.rotations_wxyz.copy()
    thrown = OUTPUT_INDEX["RightForeArm"]
    rotations[120:122, thrown] = [np.cos(0.5), 0.0, np.sin(0.5), 0.0]
    return replace(truth, positions_m=positions, rotations_wxyz=rotations)


@dataclass
class Case:
    """A studio with the take, and the take's folder and reference."""

    url: str
    take: Path
    reference: Path

    @property
    def api(self) -> str:
        return f"{self.url}/api/v1/takes/monday/one"


@pytest.fixture
def case(tmp_path: Path) -> Iterator[Case]:
    truth = performance()
    take = Take.create(
        tmp_path / "sessions/monday/one", session="monday", name="one", source="import",
        calibration_s=CALIBRATION_S,
    )  # fmt: skip
    take.meta["recording"] = "done"
    take.save_meta()
    write_solve(take, "studio", settings=preset("studio"), poses=solved(truth), metrics={}, trace=None)
    add_picture(take)
    reference = tmp_path / "truth.csv"
    rows = [",".join(["time_s", *(f"{joint}_{axis}" for joint in CANONICAL for axis in "xyz")])]
    for time_s, joints in zip(truth.time_s, canonical_positions(truth), strict=True):
        rows.append(",".join(f"{value:.6f}" for value in (time_s, *np.ravel(joints))))
    reference.write_text("\n".join(rows) + "\n")
    with studio(tmp_path / "sessions") as (app, _), serving(app) as url:
        yield Case(url, take.path, reference)


def table_of(figures: Locator) -> dict[str, str]:
    """The rows of the compare view's figures, first column, by their words."""
    return {
        row.locator("th").inner_text(): row.locator("td").first.inner_text()
        for row in figures.locator("tbody tr:not(.group)").all()
    }


def report_rows(html: str) -> dict[str, str]:
    return dict(re.findall(r"<tr><td>([^<]+)</td><td>([^<]+)</td></tr>", html.replace("&#x27;", "'")))


def printed_rows(out: str) -> dict[str, str]:
    return dict(re.findall(r"^(\S.*?)  +(\S+)$", out, re.MULTILINE))


def test_figures_and_times_agree_everywhere(case: Case, page: Page) -> None:
    page.goto(case.url)
    page.get_by_role("button", name="Replay one, solve studio").click()
    page.locator("#replay-compare").click()
    figures = page.locator("#compare .figures")
    expect(figures).to_contain_text("Jitter")
    alone = table_of(figures)
    assert set(alone) == OF_ONE_SOLVE

    # A reference adds figures and changes none.
    patient.put(f"{case.api}/references/truth.csv", content=case.reference.read_bytes()).raise_for_status()
    page.reload()
    page.locator("#compare-against").select_option("truth.csv")
    expect(figures).to_contain_text("Mean error")
    shown = table_of(figures)
    assert {words: shown[words] for words in OF_ONE_SOLVE} == alone

    answer = patient.get(
        f"{case.api}/solves/studio/figures", params={"reference": "truth.csv"}, timeout=60
    ).json()
    evaluated = patient.post(f"{case.api}/evaluate", json={"reference": "truth.csv"}, timeout=60).json()
    html = patient.get(f"{case.api}/report", params={"reference": "truth.csv"}, timeout=60).text
    done = command("evaluate", case.take, "--reference", case.reference, "--edit-list", cwd=case.take)
    assert done.returncode == 0, done.stderr
    told, printed = report_rows(html), printed_rows(done.stdout)
    of_api: dict[str, Any] = evaluated["solves"]["studio"]
    assert answer["reference"] == of_api
    for key, (on_page, in_report, on_line) in ROWS.items():
        numbers = {shown[on_page].replace(",", ""), told[in_report], printed[on_line]}
        assert len(numbers) == 1, (key, numbers)
        (number,) = numbers
        digits = len(number.partition(".")[2])
        assert number == f"{of_api[key]:.{digits}f}", key
    assert answer["own"]["own_stance_foot_slide_cm_s"] == of_api["own_stance_foot_slide_cm_s"]
    assert of_api["foot_slide_cm_s"] > 2 * of_api["own_stance_foot_slide_cm_s"]

    # The same event, 2 s after the beginning: stage time in JSON, the performance's time wherever it is read.
    (event,) = [
        one for one in of_api["cleanup_events"] if one["kind"] == "joint_pop" and one["unit"] == "deg"
    ]
    assert event["start_s"] - CALIBRATION_S == pytest.approx(2.0, abs=0.05)
    since = f"{event['start_s'] - CALIBRATION_S:.2f}"
    assert f"<td>{since}</td>" in html and f"<td>{event['start_s']:.2f}</td>" not in html
    assert (
        f"{since} s" in done.stdout and "stage time 34.00 s" in done.stdout and "stage time 34.00 s" in html
    )
    assert "time since the performance began [s]" in html
    status = patient.get(f"{case.url}/api/v1/replay").json()
    curves = patient.get(f"{case.url}/api/v1/replay/curves", params={"joint": "RightHand"}).json()
    assert (status["begins_s"], curves["start_s"], curves["time_s"][0]) == (CALIBRATION_S, CALIBRATION_S, 0.0)
    assert page.locator("#replay-time").get_attribute("title").startswith("Time since the performance began")
    page.locator("#replay-end").click()
    expect(page.locator("#replay-time")).to_have_text("0:03.9  239 / 239")
    until(lambda: patient.get(f"{case.url}/api/v1/replay").json()["time_s"] == pytest.approx(239 / 60))

"""The report of `evaluate` from solves with a known error."""

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from studio.engine.base.errors import SettingsError
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import OUTPUT_JOINTS
from studio.engine.model.spans import Span
from studio.review.report.evaluation import MeasuredSolve, evaluation_report, gain, worst_frames
from studio.review.report.evaluation_tables import ROWS
from studio.review.report.words import FRENCH, JOINTS, KINDS, Words
from tests.poses_factory import make_poses
from tests.refused import refused


def poses_of(frames: int):
    """A body that turns its arms slowly."""
    local = np.zeros((frames, len(OUTPUT_JOINTS), 4))
    local[..., 0] = 1.0
    half = 0.3 * np.sin(np.arange(frames) / 20.0)
    arm = OUTPUT_JOINTS.index("LeftArm")
    local[:, arm, 0], local[:, arm, 2] = np.cos(half), np.sin(half)
    return make_poses(local)


@pytest.fixture(scope="module")
def measured() -> tuple[dict[str, MeasuredSolve], Reference]:
    """One solve with a hand that is 5 cm off, one without errors, and the reference."""
    good = poses_of(180)
    reference = Reference(good.time_s, canonical_positions(good))
    off = np.zeros_like(good.positions_m)
    off[:, OUTPUT_JOINTS.index("LeftHand"), 0] = 0.05
    bad = replace(good, positions_m=good.positions_m + off)
    return {
        name: MeasuredSolve(poses, evaluate(poses, reference), {"ik": name})
        for name, poses in (("plain", bad), ("better <1>", good))
    }, reference


@pytest.fixture(scope="module")
def plain_page(measured) -> str:
    """The report of the first solve alone."""
    solves, reference = measured
    return evaluation_report("A take", {"plain": solves["plain"]}, reference)


def test_a_report_holds_all_its_parts(measured):
    solves, reference = measured
    html = evaluation_report("A take", solves, reference)
    for heading in ("Figures", "What each switch gained or cost", "Error over time", "Curves", "Worst moments",
                    "Error of each joint", "What would have to be cleaned up"):  # fmt: skip
        assert f"<h2>{heading}</h2>" in html
    assert "better &lt;1&gt;" in html and "better <1>" not in html
    assert "ik: plain to better &lt;1&gt;" in html
    assert "data:image/png;base64," in html and "http" not in html.replace("http://www.w3.org/2000/svg", "")
    for start in range(html.count("<svg")):
        piece = "<svg" + html.split("<svg")[start + 1].split("</svg>")[0] + "</svg>"
        ElementTree.fromstring(piece)


def test_times_count_from_the_beginning_of_the_performance(measured):
    """A calibration part of 34 s before it changes nothing in the report but the displayed stage time."""
    solves, reference = measured
    event = {"kind": "joint_pop", "joint": "head", "size": 6.0, "unit": "cm", "detail": ""}
    pages = []
    for shift_s in (0.0, 34.0):
        moved = {}
        for name, one in solves.items():
            poses = replace(one.poses, time_s=one.poses.time_s + shift_s)
            spans = {"start_s": 1.5 + shift_s, "end_s": 1.75 + shift_s, "peak_s": 1.6 + shift_s}
            moved[name] = MeasuredSolve(
                poses, one.figures | {"cleanup_events": [event | spans]}, one.settings
            )
        truth = replace(reference, time_s=reference.time_s + shift_s)
        pages.append(evaluation_report("A take", moved, truth, start_s=shift_s))
    assert "stage time 34.00 s" in pages[1] and "<td>1.50</td><td>1.75</td>" in pages[1]
    now, later = (re.sub("stage time [0-9.]+ s", "", one).split("<h2>Worst moments</h2>") for one in pages)
    assert later[0] == now[0]
    assert not re.search(r">3[4-9]\.\d\d s: ", later[1]) and re.search(r">[0-2]\.\d\d s: ", later[1])
    assert pages[0].count("time since the performance began [s]</text>") == 7  # errors, and two wrists' axes


def test_a_report_says_when_cameras_disagreed(measured, plain_page):
    solves, reference = measured
    begin_s = float(solves["plain"].poses.time_s[0])
    disagrees = {"camera_1": [Span(begin_s + 1.0, begin_s + 2.0, 0.069)]}
    html = evaluation_report("A take", {"plain": replace(solves["plain"], disagrees=disagrees)}, reference)
    told = "plain: camera_1 does not agree with the other cameras from 1.0 to 2.0 s of the solve (69 mm off)"
    assert told in html
    assert "does not agree" not in plain_page


def test_a_report_says_how_cameras_were_moved(measured, plain_page):
    solves, reference = measured
    moved = replace(solves["plain"], moved={"camera_1": (4.21, 0.153)})
    html = evaluation_report("A take", {"plain": moved}, reference)
    assert (
        "plain: camera_1 was moved by 4.2 mm and turned by 0.15 degrees before its depth was tracked." in html
    )
    assert "was moved by" not in plain_page


def test_gains_have_intervals_over_blocks():
    mean, low, high = gain(np.concatenate([np.full(60, -2.0), np.full(60, -4.0)]), 30.0)
    assert mean == -3.0 and -4.0 <= low < -3.0 < high <= -2.0


def test_worst_moments_are_apart():
    time_s = np.arange(300) / 60.0
    errors = np.zeros(300)
    errors[100:103], errors[200] = (9.0, 10.0, 9.5), 5.0
    assert worst_frames(errors, time_s)[:2] == [101, 200]
    assert np.diff(sorted(time_s[worst_frames(errors, time_s)])) == pytest.approx([1.0] * 3, abs=1.0)


def test_a_report_is_in_french_throughout(measured):
    solves, reference = measured
    event = {"start_s": 1.0, "end_s": 1.2, "size": 2.0, "unit": "cm"}
    events = [
        {**event, "kind": "self_penetration", "joint": "right_elbow", "detail": "right forearm in trunk"},
        {**event, "kind": "limb_flip", "joint": "left_wrist", "detail": "left and right swapped"},
    ]
    plain = replace(solves["plain"], figures=solves["plain"].figures | {"cleanup_events": events})
    html = evaluation_report("Une prise", solves | {"plain": plain}, reference, say=Words("fr"))
    assert '<html lang="fr">' in html
    for words in ("Erreur au cours du temps", "Pires moments", "poignet gauche, x", "coude droit",
                  "erreur des articulations, mm",
                  "avant-bras droit dans tronc", "gauche et droite échangées", "membre retourné", "mm, de face",
                  "ik : plain devient better &lt;1&gt;".replace(" :", "\u00a0:")):  # fmt: skip
        assert words in html
    html = re.sub(r"<style>.*?</style>", "", html)
    for english, french in FRENCH.items():
        if english != french and "{" not in english and len(english) > 6:
            assert f">{english}<" not in html
    assert set(ROWS[key][0] for key in ROWS) <= set(FRENCH)


def test_french_says_the_same_as_the_page():
    strings = Path(__file__).parents[3] / "studio" / "web" / "static" / "base" / "strings" / "takes"
    said = dict(
        (key, (english, french))
        for name in ("curves.js", "compare.js")
        for key, english, french in re.findall(
            r'"([a-z_.]+)": \["([^"]*)", "([^"]*)"\]', (strings / name).read_text()
        )
    )
    for kind, words in KINDS.items():
        assert said[f"edits.{kind}"] == words
    for key, (english, french) in said.items():
        if key.startswith("joint."):
            name = key.removeprefix("joint.")
            assert Words("en").joint(name) == english and Words("fr").joint(name) == french
    assert {
        key.removeprefix("joint.").split("_")[-1] for key in said if key.startswith("joint.")
    } <= JOINTS.keys()


def test_a_language_that_is_not_there_is_told():
    with refused(SettingsError, "report.language", allowed=["en", "fr"]):
        Words("de")

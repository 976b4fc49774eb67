"""The report of `evaluate` from solves with a known error."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from studio.engine.joints import OUTPUT_JOINTS
from studio.engine.metrics.canonical import canonical_positions
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference import Reference
from studio.report.evaluation import Measured, evaluation_report, gain, worst_frames
from tests.poses_factory import make_poses


def poses_of(frames: int):
    """A body that turns its arms slowly."""
    local = np.zeros((frames, len(OUTPUT_JOINTS), 4))
    local[..., 0] = 1.0
    half = 0.3 * np.sin(np.arange(frames) / 20.0)
    arm = OUTPUT_JOINTS.index("LeftArm")
    local[:, arm, 0], local[:, arm, 2] = np.cos(half), np.sin(half)
    return make_poses(local)


def test_a_report_holds_all_its_parts():
    good = poses_of(180)
    reference = Reference(good.time_s, canonical_positions(good))
    off = np.zeros_like(good.positions_m)
    off[:, OUTPUT_JOINTS.index("LeftHand"), 0] = 0.05
    bad = replace(good, positions_m=good.positions_m + off)
    solves = {
        name: Measured(poses, evaluate(poses, reference), {"ik": name})
        for name, poses in (("plain", bad), ("better <1>", good))
    }
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


def test_gains_have_intervals_over_blocks():
    mean, low, high = gain(np.concatenate([np.full(60, -2.0), np.full(60, -4.0)]), 30.0)
    assert mean == -3.0 and -4.0 <= low < -3.0 < high <= -2.0


def test_worst_moments_are_apart():
    time_s = np.arange(300) / 60.0
    errors = np.zeros(300)
    errors[100:103], errors[200] = (9.0, 10.0, 9.5), 5.0
    assert worst_frames(errors, time_s)[:2] == [101, 200]
    assert np.diff(sorted(time_s[worst_frames(errors, time_s)])) == pytest.approx([1.0] * 3, abs=1.0)

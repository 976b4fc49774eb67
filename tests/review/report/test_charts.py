"""Charts are well-formed, scales and ticks are right, and intervals match known cases."""

from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.review.report.body_diagram import body_diagram, stick_figures
from studio.review.report.bootstrap import blocks, interval
from studio.review.report.charts import Bar, bar_chart, curves, range_chart
from studio.review.report.page import Markup, bullets, html_table, page
from studio.review.report.svg import Scale, ticks

NASTY = 'a<b & "c"'


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e4))
def test_ticks_span_what_they_are_for(low, span):
    marks = ticks(low, low + span)
    assert marks[0] <= low + 1e-6 * span and marks[-1] >= low + span - 1e-6 * span
    assert 2 <= len(marks) <= 12 and np.allclose(np.diff(marks), marks[1] - marks[0], rtol=1e-6)


def test_a_scale_goes_both_ways():
    scale = Scale(0.0, 10.0, 100.0, 0.0)
    assert scale(0.0) == 100.0 and scale(10.0) == 0.0
    assert scale.many(np.array([5.0])) == pytest.approx([50.0])


def test_charts_are_well_formed_whatever_the_names():
    time_s = np.linspace(0.0, 3.0, 200)
    drawings = [
        bar_chart(
            NASTY, [Bar(NASTY, 3.0, (2.0, 4.0), 14.4), Bar("none", None), Bar("below", -1.0, None, 7.0)]
        ),
        curves(
            NASTY,
            time_s,
            {"reference": np.sin(time_s), NASTY: np.full(200, np.nan)},
            unit="cm",
            clock="time since the performance began",
            reference="reference",
        ),
        range_chart(NASTY, [(NASTY, -1.0, -2.0, -0.5), ("open", 0.1, -np.inf, np.inf)], unit="cm"),
        body_diagram(NASTY, {"head": 3.0, "left_wrist": 90.0}, most_mm=50.0),
        stick_figures(NASTY, np.random.default_rng(0).normal(size=(21, 3)), np.full((21, 3), 1.0)),
    ]
    for drawn in drawings:
        root = ElementTree.fromstring(drawn)
        assert root.tag.endswith("svg") and NASTY in root.get("aria-label")
        assert "nan" not in drawn and "inf" not in drawn


def test_a_long_title_and_the_legend_have_room():
    bars = [Bar("one", 1.0, beside=2.0)]
    for title in (
        "short",
        "a title that is a good deal longer than one bar is wide, and so makes the chart wider",
    ):
        drawn = ElementTree.fromstring(bar_chart(title, bars, words=("in it", "before")))
        words = {part.text: float(part.get("x")) for part in drawn.iter() if part.text in ("in it", title)}
        assert words[title] + 6.5 * len(title) < words["in it"]


def test_a_page_escapes_all_but_markup():
    out = page(NASTY, [html_table([NASTY], [[NASTY], [Markup("<b>x</b>")]]), bullets([NASTY])])
    assert NASTY not in out and out.count("a&lt;b &amp; ") == 5 and "<b>x</b>" in out


def test_intervals_of_a_mean():
    values = np.random.default_rng(3).normal(2.0, 1.0, 400)
    low, high = interval(values)
    assert low < values.mean() < high
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.1)
    assert interval(values) == (low, high)
    assert interval(np.full(5, 3.0)) == (3.0, 3.0)


def test_blocks_take_every_frame_once():
    assert blocks(np.arange(10.0), 4) == pytest.approx([1.5, 6.5])
    assert blocks(np.array([1.0, np.nan, 3.0]), 10) == pytest.approx([2.0])


def test_every_bar_says_what_the_one_beside_it_is():
    drawn = bar_chart(
        "Memory", [Bar("1", 2.0, beside=1.0), Bar("2", 3.0, beside=1.5)], words=("in it", "before")
    )
    assert "1, before: 1" in drawn and "2, before: 1.5" in drawn

"""What people type to find takes."""

import pytest

from studio.engine.base.errors import SettingsError
from studio.take.library.query import FIELDS, Interval, Term, folded, parse_query
from tests.refused import refused


def test_words_fields_and_quotes() -> None:
    found = parse_query('Punch -slow performer:"Anna B" tag:Best,fight "12:30 h"')
    assert found == [
        Term("", ("punch",)),
        Term("", ("slow",), negated=True),
        Term("performer", ("anna b",)),
        Term("tag", ("best", "fight")),
        Term("", ("12:30 h",)),
    ]
    assert folded("Élodie Öz") == "elodie oz"


@pytest.mark.parametrize(
    ("text", "span"),
    [
        ("length:>10s", Interval(low=10.0, with_low=False)),
        ("length:>=1:30", Interval(low=90.0)),
        ("length:2min..1:00:00", Interval(120.0, 3600.0)),
        ("length:..0,5s", Interval(high=0.5)),
        ("error:<2cm", Interval(high=20.0, with_high=False)),
        ("error:<=20", Interval(high=20.0)),
        ("rating:4", Interval(4.0, 4.0)),
        ("slide:<30mm/s", Interval(high=3.0, with_high=False)),
    ],
)
def test_numbers_have_units(text: str, span: Interval) -> None:
    (term,) = parse_query(text)
    assert term.wanted == (span,)


def test_a_date_is_a_span_of_its_own() -> None:
    (month,), (after,), (since,), (before,) = (
        parse_query(text)[0].wanted
        for text in ("date:2026-01", "date:>2026-01", "date:>=2026-01", "date:<2026-01")
    )
    assert isinstance(month, Interval) and month.high - month.low == pytest.approx(31 * 86400, abs=7200)
    assert after == Interval(low=month.high) and since == Interval(low=month.low)
    assert before == Interval(high=month.low, with_high=False)


@pytest.mark.parametrize("text", ["tag:", "length:>", "date:>=", "is:star", "   ", "-", '""'])
def test_what_is_not_finished_asks_for_nothing(text: str) -> None:
    assert parse_query(text) == []


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("colour:red", "search.field"),
        ("length:long", "search.term"),
        ("length:10kg", "search.term"),
        ("date:2026-13", "search.term"),
        ("is:blue", "search.flag"),
        ("x" * 501, "search.too_long"),
    ],
)
def test_what_is_wrong_is_told(text: str, code: str) -> None:
    with refused(SettingsError, code):
        parse_query(text)


def test_no_text_breaks_it() -> None:
    for text in (
        "'; DROP TABLE takes; --",
        "%",
        'tag:"',
        'a"b:c"d',
        "\ud800",
        *(f"{field}:'\"" for field in FIELDS if field not in ("is", "date")),
    ):
        try:
            parse_query(text)
        except SettingsError:
            continue

"""What people type to find takes: `punch tag:best performer:anna date:>=2026-01 length:>10s -error:>20mm`.

Blanks separate terms, and a take has to meet all of them; `-` in front negates one, `"..."` keeps blanks and colons
together. A term without a field is searched in a take's name, session, notes, performers and tags.
"""

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta

from studio.engine.base.errors import SettingsError

TEXTS = ("name", "session", "performer", "note", "tag", "solve", "camera", "source")
"""Fields that hold text: a tag, solve, camera or source has to match as a whole, the others in part."""

FLAGS = ("starred", "calibrated", "solved", "depth", "damaged")
"""Values of `is:`."""

UNITS: dict[str, dict[str, float]] = {
    "length": {"": 1.0, "s": 1.0, "sec": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0},
    "error": {"": 1.0, "mm": 1.0, "cm": 10.0, "m": 1000.0},
    "jitter": {"": 1.0, "mm": 1.0, "cm": 10.0},
    "slide": {"": 1.0, "cm/s": 1.0, "mm/s": 0.1, "m/s": 100.0},
    "edits": {"": 1.0, "/min": 1.0},
    "jumps": {"": 1.0},
    "rating": {"": 1.0},
    "performers": {"": 1.0},
}
"""Fields that hold numbers, with the units that each accepts; the one without a name is its default."""

FIELDS = (*TEXTS, "is", "date", *UNITS)
MAX_CHARACTERS = 500

_TERM = re.compile(r'(-)?(?:([^\W\d_]\w*):)?((?:"[^"]*"?|[^\s"])*)')
_RANGE = re.compile(
    r"(?P<low>[^<>=.][^<>=]*?)?\.\.(?P<high>[^<>=]+)?|(?P<sign>>=|<=|>|<|=)?(?P<value>[^<>=]*)"
)
_NUMBER = re.compile(r"(\d+(?:[.,]\d+)?)\s*([a-z/]*)")
_CLOCK = re.compile(r"(?:(\d+):)?(\d+):(\d+(?:[.,]\d+)?)")
_DAY = re.compile(r"(\d{4})(?:-(\d\d?))?(?:-(\d\d?))?")


@dataclass(frozen=True)
class Interval:
    """Numbers from `low` to `high`, each end included or not."""

    low: float = float("-inf")
    high: float = float("inf")
    with_low: bool = True
    with_high: bool = True


@dataclass(frozen=True)
class Term:
    """A condition that a take has to meet.

    Attributes:
        field: one of `FIELDS`, or empty: anywhere.
        wanted: folded texts or spans of numbers, of which one has to match; dates are seconds since 1970.
        negated: none of them may match.
    """

    field: str
    wanted: tuple[str | Interval, ...]
    negated: bool = False


def folded(text: str) -> str:
    """Return a text without case and accents, for comparison."""
    text = text.encode("utf-8", "replace").decode()  # half a surrogate pair is no text
    plain = unicodedata.normalize("NFKD", text.casefold())
    return "".join(sign for sign in plain if not unicodedata.combining(sign))


def parse_query(text: str) -> list[Term]:
    """Return the terms of a search; an unfinished one (`tag:`) is ignored.

    Raises:
        SettingsError: an unknown field, an invalid value, or a search that is too long.
    """
    if len(text) > MAX_CHARACTERS:
        raise SettingsError(
            "search.too_long",
            "a search of {n} characters; at most {most} are allowed",
            n=len(text),
            most=MAX_CHARACTERS,
        )
    terms = []
    for minus, field, value in _TERM.findall(text):
        if not field:
            word = folded(value.replace('"', ""))
            if word:
                terms.append(Term("", (word,), negated=bool(minus)))
            continue
        wanted = _wanted(field.lower(), value)
        if wanted:
            terms.append(Term(field.lower(), wanted, negated=bool(minus)))
    return terms


def _wanted(field: str, value: str) -> tuple[str | Interval, ...]:
    """Return the texts or spans that a field's value asks for; commas separate alternatives.

    Raises:
        SettingsError: an unknown field, or an invalid value.
    """
    if field not in FIELDS:
        raise SettingsError(
            "search.field",
            'search: the field {field!r} is not known; allowed: {fields}, or put "..." round the words',
            field=field[:40],
            fields=[*FIELDS],
        )
    if field in TEXTS:
        return tuple(folded(part.strip()) for part in value.replace('"', "").split(",") if part.strip())
    value = value.replace('"', "").lower()
    if field in UNITS:  # a comma is in a number
        span = _span(field, value, lambda text: _number(field, text))
        return () if span is None else (span,)
    parts = [part for part in value.split(",") if part]
    if field == "date":
        spans = [_span(field, part, _day) for part in parts]
        return tuple(span for span in spans if span is not None)
    wrong = [part for part in parts if not any(flag.startswith(part) for flag in FLAGS)]
    if wrong:
        raise SettingsError(
            "search.flag",
            "search: is:{flag} is not known; allowed: {flags}",
            flag=wrong[0][:40],
            flags=[*FLAGS],
        )
    return tuple(part for part in parts if part in FLAGS)


def _span(field: str, text: str, read: Callable[[str], Interval]) -> Interval | None:
    """Return the span of `>10`, `<=10`, `10`, `5..10`, `5..`; None if the value is missing."""
    found = _RANGE.fullmatch(text)
    if found is None:
        raise _wrong(field, text)
    low, high, sign, value = found.group("low", "high", "sign", "value")
    if value is None:
        begin = read(low) if low else Interval()
        end = read(high) if high else Interval()
        return Interval(begin.low, end.high, begin.with_low, end.with_high)
    if not value:
        return None
    one = read(value)
    # A day is a span: `>` begins after its end, `>=` includes it.
    return {
        ">": Interval(low=one.high, with_low=not one.with_high),
        ">=": Interval(low=one.low),
        "<": Interval(high=one.low, with_high=False),
        "<=": Interval(high=one.high, with_high=one.with_high),
    }.get(sign or "=", one)


def _number(field: str, text: str) -> Interval:
    clock = _CLOCK.fullmatch(text) if field == "length" else None
    if clock is not None:
        hours, minutes, seconds = (float((part or "0").replace(",", ".")) for part in clock.groups())
        value = 3600.0 * hours + 60.0 * minutes + seconds
        return Interval(value, value)
    found = _NUMBER.fullmatch(text.strip())
    if found is None or found.group(2) not in UNITS[field]:
        raise _wrong(field, text)
    value = float(found.group(1).replace(",", ".")) * UNITS[field][found.group(2)]
    return Interval(value, value)


def _day(text: str) -> Interval:
    """Return the year, month or day as seconds since 1970, by the clock of this machine."""
    found = _DAY.fullmatch(text)
    try:
        if found is None:
            raise ValueError(text)
        year, month, day = (int(part) if part else None for part in found.groups())
        begin = datetime(year or 1, month or 1, day or 1)
        if month is None:
            end = datetime(begin.year + 1, 1, 1)
        elif day is None:
            end = datetime(begin.year + month // 12, month % 12 + 1, 1)
        else:
            end = begin + timedelta(days=1)
        return Interval(begin.astimezone().timestamp(), end.astimezone().timestamp(), with_high=False)
    except (ValueError, OverflowError) as error:
        raise _wrong("date", text) from error


def _wrong(field: str, text: str) -> SettingsError:
    example = (
        "2026, 2026-01 or 2026-01-31, >2026-01, 2026-01..2026-03"
        if field == "date"
        else f">10{_unit(field)}, <=10{_unit(field)}, 5..10"
    )
    return SettingsError(
        "search.term",
        "search: {term} is not understood; allowed: {example}",
        term=f"{field}:{text[:40]}",
        example=example,
    )


def _unit(field: str) -> str:
    return list(UNITS[field])[1] if len(UNITS[field]) > 1 else ""

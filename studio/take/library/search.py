"""Columns of the index of takes for searches, and a search as a condition of SQL."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from studio.take.library.query import Interval, Term, folded
from studio.take.library.sessions import TakeInfo
from studio.take.library.slate import RATINGS

COLUMNS = (
    "created", "date", "length", "rating", "anywhere", "name", "session", "performer", "note", "tag", "solve",
    "camera", "source", "flags", "performers",
)  # fmt: skip
"""Columns of a take besides its id, stamp and line of the list."""

_PARTS = ("name", "session", "performer", "note")
_WHOLE = ("tag", "solve", "camera", "source")
_OWN_NUMBERS = ("date", "length", "rating", "performers")
_END = "\n"


def row_of(info: TakeInfo) -> list[Any]:
    """Return a take's values for `COLUMNS`; texts are folded, lists stand between line ends."""
    performer = " ".join([str(info.performer), *performers_of(info)])
    told = [f"{info.session}/{info.name}", info.notes, performer, *info.tags]
    anywhere = " ".join(map(str, [*told, "starred ★"] if info.starred else told))
    flags = {
        "starred": bool(info.starred),
        "calibrated": info.calibrated,
        "solved": bool(info.solves),
        "depth": bool(info.depth),
        "damaged": info.problem is not None,
    }
    values = {
        "created": info.created.encode("utf-8", "replace").decode(),
        "date": created_s(info.created),
        "length": performance_s(info),
        "rating": info.rating if info.rating in RATINGS else None,
        "anywhere": folded(anywhere),
        "name": folded(info.name),
        "session": folded(info.session),
        "performer": folded(performer),
        "note": folded(str(info.notes)),
        "tag": _list(info.tags),
        "solve": _list(info.solves),
        "camera": _list(info.cameras),
        "source": _list([info.source]),
        "performers": max(len(info.performers), 1) if info.solves else None,
        "flags": _list([name for name, is_so in flags.items() if is_so]),
    }
    return [values[column] for column in COLUMNS]


def performers_of(info: TakeInfo) -> list[str]:
    """Return the names of a take's several performers, as given or `performer_1`, ..."""
    return [info.performer_names.get(name, name) for name in info.performers]


def performance_s(info: TakeInfo) -> float | None:
    """Return the length of the performance [s], without the part for calibration; None if unknown."""
    return None if info.length_s is None else max(info.length_s - (info.calibration_s or 0.0), 0.0)


def created_s(created: str) -> float | None:
    """Return when a take was made, as seconds since 1970; None where the text is no time. Without a zone: UTC."""
    try:
        moment = datetime.fromisoformat(created)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None


def where(terms: Sequence[Term]) -> tuple[str, list[Any]]:
    """Return the condition that takes meet, and its values."""
    conditions, values = ["1"], []
    for term in terms:
        one_of = []
        for wanted in term.wanted:
            condition, more = _condition(term.field, wanted)
            one_of.append(condition)
            values += more
        conditions.append(f"{'NOT ' if term.negated else ''}coalesce({' OR '.join(one_of)}, 0)")
    return " AND ".join(conditions), values


def _condition(field: str, wanted: str | Interval) -> tuple[str, list[Any]]:
    if isinstance(wanted, str):
        if field in ("", *_PARTS):
            return f"instr({field or 'anywhere'}, ?) > 0", [wanted]
        column = "flags" if field == "is" else field
        return f"instr({column}, ?) > 0", [f"{_END}{wanted}{_END}"]
    inside = f"{{0}} >{'=' * wanted.with_low} ? AND {{0}} <{'=' * wanted.with_high} ?"
    values: list[Any] = [wanted.low, wanted.high]
    if field in _OWN_NUMBERS:
        return inside.format(field), values
    return (
        f"EXISTS (SELECT 1 FROM figures WHERE figures.id = takes.id AND figure = ? AND {inside.format('value')})",
        [
            field,
            *values,
        ],
    )


def _list(texts: Sequence[str]) -> str:
    return _END + "".join(folded(text) + _END for text in texts)

"""Charts of reports: bars with intervals and comparison values, and curves over time."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.review.report.svg import (
    BESIDE,
    COLOURS,
    FAINT,
    GRID,
    INK,
    REFERENCE,
    Scale,
    drawing,
    line,
    number,
    path,
    rectangle,
    text,
    ticks,
)

_MOST_POINTS = 1200
_TITLE_LETTER, _LEGEND = 6.9, 115.0
"""Approximate widths of a title letter and of a legend [px]."""


@dataclass(frozen=True)
class Bar:
    """One condition of a chart.

    Attributes:
        label: under the bar.
        value: height; None = not measured.
        interval: of the value, drawn as a whisker.
        beside: value to compare with, drawn in grey.
    """

    label: str
    value: float | None
    interval: tuple[float, float] | None = None
    beside: float | None = None


def bar_chart(
    title: str, bars: list[Bar], *, height: float = 240, words: tuple[str, str] = ("here", "thesis")
) -> str:
    """Return bars side by side; a missing value leaves a gap.

    Args:
        words: legend for bars and comparison values; drawn if there are comparison values.
    """
    with_legend = any(bar.beside is not None for bar in bars)
    title_width = 56.0 + _TITLE_LETTER * len(title) + (_LEGEND if with_legend else 0.0)
    width = max(360.0, 50.0 + 66.0 * len(bars), title_width)
    left, right, top, bottom = 42.0, 8.0, 28.0, 62.0
    known = [v for bar in bars for v in (bar.value, bar.beside, *(bar.interval or ())) if v is not None]
    marks = ticks(min([0.0, *known]), max([1e-6, *known]), 4)
    y = Scale(marks[0], marks[-1], height - bottom, top)
    parts = [text(left, 16, title, size=12, bold=True)]
    if with_legend:
        parts += _bar_legend(width - right, words)
    for mark in marks:
        parts += [line(left, y(mark), width - right, y(mark)), _tick(left - 5, y(mark) + 3.5, mark)]
    step = (width - left - right) / max(len(bars), 1)
    wide = min(26.0, 0.36 * step)
    for k, bar in enumerate(bars):
        middle = left + (k + 0.5) * step
        place = middle - wide if bar.beside is not None else middle - 0.5 * wide
        if bar.value is not None:
            parts.append(_bar(place, wide, y, bar.value, COLOURS[0], f"{bar.label}: {bar.value:.2f}"))
        else:
            parts.append(text(place + 0.5 * wide, y(0.0) - 4, "none", size=9, fill=FAINT, anchor="middle"))
        if bar.interval is not None:
            x = place + 0.5 * wide
            parts.append(line(x, y(bar.interval[0]), x, y(bar.interval[1]), stroke=INK, width=1.4))
        if bar.beside is not None:
            parts.append(
                _bar(middle, wide, y, bar.beside, BESIDE, f"{bar.label}, {words[1]}: {bar.beside:g}")
            )
        for row, line_of_label in enumerate(_wrapped(bar.label, max(6, int(step / 5.2)))[:4]):
            parts.append(
                text(middle, height - bottom + 14 + 11 * row, line_of_label, size=9.5, anchor="middle")
            )
    parts.append(line(left, y(0.0), width - right, y(0.0), stroke=FAINT))
    return drawing(width, height, parts, title)


def _bar_legend(right: float, words: tuple[str, str]) -> list[str]:
    parts = []
    for x, fill, word in ((right - 92, COLOURS[0], words[0]), (right - 50, BESIDE, words[1])):
        parts += [rectangle(x, 8, 9, 9, fill=fill), text(x + 13, 16, word, size=9.5, fill=FAINT)]
    return parts


def _bar(x: float, wide: float, y: Scale, value: float, fill: str, title: str) -> str:
    top, foot = sorted((y(value), y(0.0)))
    return rectangle(x, top, wide - 1.5, foot - top, fill=fill, title=title)


def _tick(x: float, y: float, value: float) -> str:
    return text(x, y, f"{value:g}", size=9.5, fill=FAINT, anchor="end")


def _wrapped(words: str, most: int) -> list[str]:
    rows = [""]
    for word in words.split():
        if rows[-1] and len(rows[-1]) + 1 + len(word) > most:
            rows.append(word)
        else:
            rows[-1] = f"{rows[-1]} {word}".strip()
    return rows


def curves(
    title: str,
    time_s: NDArray[np.float64],
    series: dict[str, NDArray[np.float64]],
    *,
    unit: str,
    clock: str,
    reference: str | None = None,
    width: float = 860,
    height: float = 204,
) -> str:
    """Return values over time.

    Args:
        title: of the chart.
        time_s: times, shape (n,).
        clock: text under the axis that explains its zero.
        series: values by name, shape (n,) each; NaN = none.
        unit: of the values.
        reference: the series drawn dark instead of coloured.
    """
    left, right, top, bottom = 46.0, 10.0, 26.0, 40.0
    every = max(1, -(-len(time_s) // _MOST_POINTS))
    values = np.concatenate([one[np.isfinite(one)] for one in series.values()])
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    marks, seconds = ticks(low, max(high, low + 1e-6), 4), ticks(float(time_s[0]), float(time_s[-1]), 8)
    y = Scale(marks[0], marks[-1], height - bottom, top)
    x = Scale(float(time_s[0]), float(time_s[-1]), left, width - right)
    parts = [text(left, 15, f"{title} [{unit}]", size=12, bold=True)]
    for mark in marks:
        parts += [line(left, y(mark), width - right, y(mark)), _tick(left - 5, y(mark) + 3.5, mark)]
    for second in seconds:
        if time_s[0] <= second <= time_s[-1]:
            parts += [
                line(x(second), height - bottom, x(second), height - bottom + 4, stroke=FAINT),
                text(x(second), height - 22, f"{second:g}", size=9.5, fill=FAINT, anchor="middle"),
            ]
    parts.append(text(width - right, height - 8, f"{clock} [s]", size=9.5, fill=FAINT, anchor="end"))
    colours = iter(COLOURS * 4)
    for name, one in series.items():
        stroke = REFERENCE if name == reference else next(colours)
        parts.append(path(x.many(time_s[::every]), y.many(one[::every]), stroke=stroke, width=1.3))
    parts += _legend(list(series), reference, width - right)
    return drawing(width, height, parts, title)


def _legend(names: list[str], reference: str | None, right: float) -> list[str]:
    """Names with their colours, in the upper right corner."""
    colours = iter(COLOURS * 4)
    strokes = [REFERENCE if name == reference else next(colours) for name in names]
    widths = [22.0 + 6.2 * len(name) for name in names]
    starts = right - sum(widths) + np.concatenate([[0.0], np.cumsum(widths)])
    out = []
    for name, stroke, (start, _) in zip(names, strokes, pairwise(starts), strict=True):
        out += [
            line(start, 11, start + 14, 11, stroke=stroke, width=2.4),
            text(start + 18, 15, name, size=10.5),
        ]
    return out


def range_chart(
    title: str, rows: list[tuple[str, float, float, float]], *, unit: str, width: float = 500
) -> str:
    """Return changes with their intervals, one row each: (label, change, low, high); below 0 is drawn green."""
    left = 18.0 + 5.9 * max((len(row[0]) for row in rows), default=0)
    right, top, step = 14.0, 40.0, 19.0
    height = top + step * len(rows) + 14
    finite = [v for row in rows for v in row[1:] if np.isfinite(v)]
    marks = ticks(min([0.0, *finite]), max([1e-6, *finite]), 6)
    x = Scale(marks[0], marks[-1], left, width - right)
    parts = [text(8, 16, f"{title} [{unit}]", size=12, bold=True)]
    for mark in marks:
        parts += [
            line(x(mark), top - 6, x(mark), height - 10, stroke=FAINT if mark == 0 else GRID),
            text(x(mark), top - 10, f"{mark:g}", size=9.5, fill=FAINT, anchor="middle"),
        ]
    for k, (label, change, low, high) in enumerate(rows):
        y = top + step * (k + 0.5)
        colour = COLOURS[2] if high < 0 else COLOURS[7] if low > 0 else FAINT
        ends = [float(np.clip(end, marks[0], marks[-1])) for end in (low, high)]
        parts += [
            text(left - 10, y + 3.5, label, size=10.5, anchor="end"),
            line(x(ends[0]), y, x(ends[1]), y, stroke=colour, width=2.0),
            f'<circle cx="{number(x(change))}" cy="{number(y)}" r="3.4" fill="{colour}"/>',
        ]
    return drawing(width, height, parts, title)

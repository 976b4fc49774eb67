"""The report of a take of several performers: whether each kept their identity, then a section each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.alignment import Alignment
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.metrics.results import SeveralEvaluation
from studio.engine.model.joints import INDEX
from studio.review.report.evaluation import MeasuredSolve, intro, report_parts
from studio.review.report.page import bullets, charts_row, html_table, page, paragraph, safe
from studio.review.report.svg import COLOURS, GRID, REFERENCE, Scale, drawing, line, path, text, ticks
from studio.review.report.words import ENGLISH, Words

_MOST_DOUBTS = 12
"""Maximum number of undecided spans listed per performer and solve; the table sums all."""

_MAP_PX = 420.0
_HIPS = INDEX["hips"]

Spans = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class ReportedPerformer:
    """A performer of a report.

    Attributes:
        name: name to display.
        key: key of their figures in a `SeveralEvaluation`.
        solves: by name of the solve.
        reference: their reference motion.
        undecided_s: by solve, the spans of stage time [s] with uncertain identity.
    """

    name: str
    key: str
    solves: Mapping[str, MeasuredSolve]
    reference: Reference | Markers
    undecided_s: Mapping[str, Spans]


def performers_report(
    title: str,
    performers: Sequence[ReportedPerformer],
    figures: Mapping[str, SeveralEvaluation],
    *,
    start_s: float | None = None,
    say: Words = ENGLISH,
) -> str:
    """Return the report as one HTML page; changes are relative to the first solve.

    Args:
        title: of the page, such as the take's name.
        performers: at least one, all with the same solves.
        figures: by solve, from `evaluate_several`.
        start_s: stage time before which nothing counts.
        say: the reader's words.
    """
    base = next(iter(figures))
    begins_s = min(one.solves[base].poses.begins_s for one in performers)
    parts = [
        *intro(figures, begins_s, say),
        _heading(say("Performers"), 2),
        _together(performers, figures, say),
        paragraph(
            say(
                "One transform aligns all performers. A performer became another where they are nearer to the "
                "other's reference."
            ),
            "faint",
        ),
        bullets(_doubts(performers, begins_s, say)),
        _heading(say("Where they were"), 2),
        charts_row([_map(solve, performers, start_s, say) for solve in figures]),
    ]
    for one in performers:
        sections = report_parts(
            one.solves, one.reference, start_s=start_s, begins_s=begins_s, level=3, say=say
        )
        parts += [_heading(one.name, 2), *sections]
    return page(title, parts, say.language)


def _heading(words: str, level: int) -> str:
    return f"<h{level}>{safe(words)}</h{level}>"


def _together(
    performers: Sequence[ReportedPerformer], figures: Mapping[str, SeveralEvaluation], say: Words
) -> str:
    rows = [
        [say("became another"), *(str(one["identity_switches"]) for one in figures.values())],
        [say("frames missed, %"), *(f"{one['missed_percent']:.1f}" for one in figures.values())],
        [say("undecided, %"), *(f"{one['undecided_percent']:.1f}" for one in figures.values())],
    ]
    for performer in performers:
        errors = (one["performers"][performer.key]["mpjpe_mm"] for one in figures.values())
        words = say("joint error of {name}, mm", name=performer.name)
        rows.append([words, *(f"{error:.1f}" for error in errors)])
    return html_table(["", *figures], rows)


def _doubts(performers: Sequence[ReportedPerformer], begins_s: float, say: Words) -> list[str]:
    """Return sentences on when performers were not distinguished, in seconds since the performance began."""
    return [
        say(
            "{name}, {solve}: not told apart from another from {since} to {until} s.",
            name=one.name,
            solve=solve,
            since=f"{begin - begins_s:.1f}",
            until=f"{end - begins_s:.1f}",
        )
        for one in performers
        for solve, spans in one.undecided_s.items()
        for begin, end in spans[:_MOST_DOUBTS]
    ]


def _map(solve: str, performers: Sequence[ReportedPerformer], start_s: float | None, say: Words) -> str:
    """Return the paths of all performers over the floor, in the frame of the references."""
    paths, references = [], []
    for one in performers:
        mine = one.solves[solve]
        counts = mine.poses.time_s >= (-np.inf if start_s is None else start_s)
        alignment = Alignment.from_json(mine.figures["alignment"])
        hips = canonical_positions(mine.poses)[counts, _HIPS]
        paths.append(alignment.to_reference(hips)[:, :2])
        references.append(_reference_path(one.reference, mine.poses.time_s[counts], alignment))
    places = np.concatenate([*paths, *references])
    places = places[np.isfinite(places).all(axis=1)]
    low, high = places.min(axis=0) - 0.3, places.max(axis=0) + 0.3
    side = float((high - low).max())
    middle = (low + high) / 2.0
    x = Scale(middle[0] - side / 2, middle[0] + side / 2, 8.0, _MAP_PX - 8.0)
    y = Scale(middle[1] - side / 2, middle[1] + side / 2, _MAP_PX - 8.0, 30.0)
    parts = _metres(x, y)
    for known in references:
        parts.append(_path(known, x, y, REFERENCE, 1.0).replace("<path ", '<path stroke-dasharray="3 4" '))
    for k, (one, own) in enumerate(zip(performers, paths, strict=True)):
        colour = COLOURS[k % len(COLOURS)]
        parts += [
            _path(own, x, y, colour, 1.8),
            text(12 + 110 * k, 44, one.name, size=11, fill=colour, bold=True),
        ]
    title = say("{solve}, from above: solve, and reference dashed", solve=solve)
    return drawing(_MAP_PX, _MAP_PX, [text(8, 18, title, size=12, bold=True), *parts], title)


def _reference_path(
    reference: Reference | Markers, times_s: NDArray[np.float64], alignment: Alignment
) -> NDArray[np.float64]:
    """Return the path of a reference's hips over the floor during the solve, shape (N, 2); empty for markers."""
    if not isinstance(reference, Reference) or not len(times_s):
        return np.zeros((0, 2))
    since, until = times_s[[0, -1]] + alignment.offset_s
    shown = (reference.time_s >= since) & (reference.time_s <= until)
    return reference.positions_m[shown, _HIPS, :2]


def _path(places: NDArray[np.float64], x: Scale, y: Scale, colour: str, width: float) -> str:
    every = max(1, len(places) // 1500)
    shown = places[::every]
    return path(x.many(shown[:, 0]), y.many(shown[:, 1]), stroke=colour, width=width)


def _metres(x: Scale, y: Scale) -> list[str]:
    """Return a one-metre grid."""
    across = [mark for mark in ticks(x.low, x.high, 6) if x.low < mark < x.high]
    up = [mark for mark in ticks(y.low, y.high, 6) if y.low < mark < y.high]
    lines = [line(x(mark), y.end, x(mark), y.start, stroke=GRID) for mark in across]
    lines += [line(x.start, y(mark), x.end, y(mark), stroke=GRID) for mark in up]
    return [*lines, *(text(x(mark) + 2, y.start - 3, f"{mark:g} m", size=9.5) for mark in across)]

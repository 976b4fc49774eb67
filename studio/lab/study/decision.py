"""Table 6.1: each component with its accuracy, its clean-up, its votes, and the decision."""

from typing import TypedDict

from studio.lab.study.results import Results
from studio.lab.study.thesis_tables import COMPONENTS, FOUR, LABELS, Component
from studio.lab.study.votes import Votes
from studio.review.report.page import Markup, html_table

RULE = (
    "Kept here: neither the absolute difference nor the clean-up rises and at least one of absolute difference, "
    "shortest distance and clean-up falls, each by more than chance over motions and seeds (95 %); and of the votes "
    "that were cast here, at least half are for it. `open` where neither is shown."
)


class Decision(TypedDict):
    """A component: mean figures here and in the thesis, votes `for` it `of` all, and whether it is kept."""

    component: str
    figures: dict[str, float | None]
    thesis: dict[str, float] | None
    votes: dict[str, int] | None
    thesis_votes: str
    kept: str
    thesis_kept: str


def decisions(results: Results, votes: Votes) -> list[Decision]:
    """Return a row for each component with recordings in the study."""
    return [_row(one, results, votes) for one in COMPONENTS if results.of(one.condition)]


def _row(one: Component, results: Results, votes: Votes) -> Decision:
    cast = votes.get(one.sides) if one.sides is not None else None
    return {
        "component": one.title,
        "figures": {name: results.mean(one.condition, name) for name in LABELS},
        "thesis": None if one.thesis is None else dict(zip(FOUR, one.thesis, strict=True)),
        "votes": None if cast is None or cast[1] == 0 else {"for": cast[0], "of": cast[1]},
        "thesis_votes": one.votes,
        "kept": _kept(one, results, cast),
        "thesis_kept": one.kept,
    }


def _kept(one: Component, results: Results, cast: tuple[int, int] | None) -> str:
    changes = {
        name: results.change(one.base, one.condition, name)
        for name in ("absolute_difference_cm", "shortest_distance_cm", "cleanup_events_per_min")
    }
    directions = {name: change.direction for name, change in changes.items() if change is not None}
    if not directions:
        return f"no: {problems[0].split(':')[0]}" if (problems := results.problems(one.condition)) else "open"
    if directions.get("absolute_difference_cm") == 1 or directions.get("cleanup_events_per_min") == 1:
        return "no"
    if cast is not None and cast[1] and 2 * cast[0] < cast[1]:
        return "no"
    return "yes" if -1 in directions.values() else "open"


def decision_rows(rows: list[Decision]) -> list[list[str]]:
    """Return the table for the terminal, heading first."""
    names = [*FOUR, "cleanup_events_per_min"]
    out = [["6.1 Components", *(LABELS[name].split(",")[0] for name in names), "votes", "kept"]]
    for row in rows:
        cells = [row["component"]]
        for name in names:
            mean = row["figures"][name]
            known = row["thesis"] if name in FOUR else None
            shown = "-" if mean is None else f"{mean:z.1f}"
            cells.append(shown if known is None else f"{shown} ({known[name]:g})")
        cast = row["votes"]
        shown = "-" if cast is None else f"{cast['for']}/{cast['of']}"
        cells += [f"{shown} ({row['thesis_votes']})", f"{row['kept']} ({row['thesis_kept']})"]
        out.append(cells)
    return out


def decision_html(rows: list[Decision]) -> str:
    """Return the table, with the thesis's figures in brackets."""
    header, *body = decision_rows(rows)
    marked = [[*row[:-1], Markup(f"<b>{row[-1]}</b>")] for row in body]
    return html_table(header, marked)

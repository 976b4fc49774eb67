"""A table of the thesis next to the study's figures: as JSON, on the terminal, as HTML, and as charts."""

from typing import TypedDict

from studio.lab.study.results import Results
from studio.lab.study.thesis_tables import FOUR, LABELS, Condition, Table
from studio.review.report.charts import Bar, bar_chart
from studio.review.report.page import Markup, html_table


class FigureJson(TypedDict):
    """A figure of a condition: its mean, its change from the table's base over `pairs`, 95 % intervals; null = not
    measured."""

    mean: float | None
    interval_95: list[float] | None
    change: float | None
    change_interval_95: list[float] | None
    pairs: int | None


class ConditionJson(TypedDict):
    """A condition: number of recordings and of those with a problem, figures here and in the thesis."""

    condition: str
    variant: str
    cameras: int
    interference: bool
    recordings: int
    problems: int
    first_problem: str | None
    thesis: dict[str, float] | None
    figures: dict[str, FigureJson]


class TableJson(TypedDict):
    """A table of the thesis with the study's figures."""

    table: str
    title: str
    conditions: list[ConditionJson]


def here(table: Table, results: Results) -> list[Condition]:
    """Conditions of a table that have recordings in the study."""
    return [condition for condition in table.conditions if results.of(condition)]


def table_json(table: Table, results: Results) -> TableJson:
    """Return a table's figures."""
    out: list[ConditionJson] = []
    for condition in here(table, results):
        problems = results.problems(condition)
        out.append(
            {
                "condition": condition.title,
                "variant": condition.variant,
                "cameras": condition.cameras,
                "interference": condition.interference,
                "recordings": len(results.of(condition)),
                "problems": len(problems),
                "first_problem": problems[0] if problems else None,
                "thesis": None
                if condition.thesis is None
                else dict(zip(FOUR, condition.thesis, strict=True)),
                "figures": {name: _figure(table, condition, name, results) for name in LABELS},
            }
        )
    return {"table": table.number, "title": table.title, "conditions": out}


def _figure(table: Table, condition: Condition, name: str, results: Results) -> FigureJson:
    spread = results.spread(condition, name)
    change = None if condition is table.base else results.change(table.base, condition, name)
    return {
        "mean": results.mean(condition, name),
        "interval_95": None if spread is None else list(spread),
        "change": None if change is None else change.difference,
        "change_interval_95": None if change is None or change.count < 2 else [change.low, change.high],
        "pairs": None if change is None else change.count,
    }


def table_text(table: Table, results: Results) -> list[list[str]]:
    """Return a table's rows for the terminal: one row per figure, cells as `study (thesis)`."""
    conditions = here(table, results)
    rows = [[f"{table.number} {table.title}", *(condition.title for condition in conditions)]]
    for index, name in enumerate(LABELS):
        row = [LABELS[name]]
        for condition in conditions:
            mean = results.mean(condition, name)
            shown = "-" if mean is None else f"{mean:z.1f}"
            known = condition.thesis if name in FOUR else None
            row.append(shown if known is None else f"{shown} ({known[index]:g})")
        rows.append(row)
    return rows


def table_html(table: Table, results: Results) -> str:
    """Return a table, one row per figure; cells have the study's mean, its change, the thesis's figure."""
    conditions = here(table, results)
    rows = [
        [LABELS[name], *(_cell(table, condition, name, results) for condition in conditions)]
        for name in LABELS
    ]
    usable = [
        f"{len(results.of(condition)) - len(results.problems(condition))} of {len(results.of(condition))}"
        for condition in conditions
    ]
    rows.append(["recordings that could be used", *usable])
    return html_table([table.number, *(condition.title for condition in conditions)], rows)


def _cell(table: Table, condition: Condition, name: str, results: Results) -> str:
    mean = results.mean(condition, name)
    lines = ["-" if mean is None else f"<b>{mean:z.1f}</b>"]
    change = None if condition is table.base else results.change(table.base, condition, name)
    if change is not None and change.count > 1:
        lines.append(f"<small>{change.difference:+.1f} [{change.low:+.1f}, {change.high:+.1f}]</small>")
    if condition.thesis is not None and name in FOUR:
        lines.append(f"<small>thesis {condition.thesis[FOUR.index(name)]:g}</small>")
    return Markup("<br>".join(lines))


def table_charts(table: Table, results: Results) -> dict[str, str]:
    """Return an SVG for each of the thesis's four figures and for the clean-up, by the figure's name."""
    conditions = here(table, results)
    charts = {}
    for name in (*FOUR, "cleanup_events_per_min"):
        bars = [
            Bar(
                condition.title,
                results.mean(condition, name),
                results.spread(condition, name),
                None if condition.thesis is None or name not in FOUR else condition.thesis[FOUR.index(name)],
            )
            for condition in conditions
        ]
        charts[name] = bar_chart(f"{table.number}: {LABELS[name]}", bars)
    return charts

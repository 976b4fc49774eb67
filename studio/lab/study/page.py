"""The report of a study: `study.json`, tables as text, plots of each table, and one page."""

from pathlib import Path

from studio.engine.base.files import write_atomically, write_json
from studio.lab.study.decision import RULE, decision_html, decisions
from studio.lab.study.plan import Study
from studio.lab.study.results import CellJson, Results
from studio.lab.study.tables import table_charts, table_html, table_json
from studio.lab.study.thesis_tables import FOUR, LABELS, TABLES, Condition, Table
from studio.lab.study.votes import Votes
from studio.lab.study.words import ThesisFinding, findings, headline, reasons, singles
from studio.review.report.charts import range_chart
from studio.review.report.page import Markup, bullets, charts_row, page, paragraph, safe

_WORDS = {"agrees": "agrees", "differs": "does not", "open": "not told"}


def write_study(study: Study, cells: list[CellJson], votes: Votes, out: Path) -> Path:
    """Write all of a study's results below `out`; return the page's path."""
    results = Results(cells)
    shown = [table for table in TABLES if any(results.of(condition) for condition in table.conditions)]
    rows = decisions(results, votes)
    write_json(
        out / "study.json",
        {
            "motions": list(study.motions),
            "cameras": list(study.cameras),
            "seeds": study.seeds,
            "cells": len(study.cells),
            "cells_done": len(cells),
            "cpu_s": round(sum(cell["cpu_s"] for cell in cells), 1),
            "tables": [table_json(table, results) for table in shown],
            "decision": rows,
            "findings": {table.number: [vars(one) for one in findings(table, results)] for table in shown},
            "reasons": {table.number: reasons(table, results) for table in shown},
        },
    )
    parts = [*_summary(study, cells, shown, results)]
    for table in shown:
        charts = table_charts(table, results)
        for name, chart in charts.items():
            _write(out / "plots" / f"table_{table.number.replace('.', '_')}_{name}.svg", chart)
        parts += _section(table, results, charts)
    parts += _switches(results, out)
    parts += ["<h2>6.1 The components, and what is kept</h2>", decision_html(rows), paragraph(RULE, "faint")]
    parts += _hands(results)
    path = out / "study.html"
    _write(path, page("The thesis's experiments again", parts))
    return path


def _write(path: Path, words: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with write_atomically(path) as file:
        file.write(words.encode())


def _summary(study: Study, cells: list[CellJson], shown: list[Table], results: Results) -> list[str]:
    every = [one for table in shown for one in findings(table, results)]
    counts = {verdict: sum(one.verdict == verdict for one in every) for verdict in _WORDS}
    made = (
        f"{len(cells)} of {len(study.cells)} solves"
        if len(cells) < len(study.cells)
        else f"{len(cells)} solves"
    )
    return [
        paragraph(
            f"{made}: {', '.join(study.motions)}; {', '.join(map(str, study.cameras))} cameras, with and without "
            f"interference; {study.seeds} seed{'s'[: study.seeds > 1]}. Cameras are simulated (true joints with a "
            "tracker's errors), so the truth is known exactly; it scores solves and never enters them. Wrists "
            "relative to the chest, as the thesis has them. The thesis: Ménard 2014.",
            "faint",
        ),
        paragraph(
            f"Of {len(every)} comparisons with the thesis {counts['agrees']} agree in direction, {counts['differs']} "
            f"do not, and {counts['open']} cannot be told from chance with this many recordings. Intervals are 95 %, "
            "by bootstrap over motions and seeds; a change is reported if its interval leaves out 0."
        ),
        "<h2>The headline</h2>",
        bullets(headline(results)),
    ]


def _section(table: Table, results: Results, charts: dict[str, str]) -> list[str]:
    told = findings(table, results)
    why = [] if table.number == "5.6" else reasons(table, results)
    return [
        f"<h2>{table.number} {safe(table.title)}</h2>",
        table_html(table, results),
        charts_row(list(charts.values())),
        *(("<h3>Beside the thesis</h3>", bullets([_marked(one) for one in told])) if told else ()),
        *(("<h3>Why</h3>", bullets(why)) if why else ()),
    ]


def _marked(one: ThesisFinding) -> str:
    return Markup(f'<b class="{one.verdict}">{_WORDS[one.verdict]}</b>: {safe(one.text)}')


def _switches(results: Results, out: Path) -> list[str]:
    """The effect of each single switch of the presets `thesis` and `studio`, with two cameras."""
    parts = []
    for preset in ("thesis", "studio"):
        charts = []
        for name in (*FOUR[:2], "mpjpe_mm", "cleanup_events_per_min"):
            rows = [
                (title, change.difference, change.low, change.high)
                for title, change in singles(results, preset, name)
                if change.count > 1
            ]
            if rows:
                rows.sort(key=lambda row: row[1])
                charts.append(range_chart(f"Change of {LABELS[name].split(',')[0]}", rows, unit=_unit(name)))
                _write(out / "plots" / f"switches_{preset}_{name}.svg", charts[-1])
        if charts:
            parts += [f"<h2>One switch at a time from preset {preset}, two cameras</h2>", charts_row(charts)]
    return parts


def _unit(name: str) -> str:
    return name.rsplit("_", 1)[1] if name.endswith(("_cm", "_mm")) else "a minute"


def _hands(results: Results) -> list[str]:
    """The study's statement about hands: simulated skeletons have no hand states."""
    change = results.change(
        Condition("", "thesis:hands=off", 2, True), Condition("", "thesis", 2, True), "cleanup_events_per_min"
    )
    if change is None:
        return []
    return [
        "<h2>Hands</h2>",
        paragraph(
            f"Hands on against off: clean-up {change.difference:+.1f} a minute. Simulated skeletons carry no hand "
            "states, so fingers do not move here, and neither accuracy nor votes follow. The thesis's circles "
            "were right in 66.8 % of the frames and undecided in 41.2 %; what the studio's circles and its own "
            "method reach on depth images stands in docs/experiments/hands_and_heads.md."
        ),
    ]

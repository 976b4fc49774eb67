"""`studio study`: the thesis's experiments."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_json, progress_bar, table

_TEXT = """\
Repeat the thesis's experiments over motions, cameras and seeds, as tables and plots.

Simulated cameras watch the thesis's four movements of the arms, or the animations that are given; each recording is
solved with one switch changed at a time, and measured against the truth. What is done is kept in DIR: a study that
was broken off, or asks for more seeds, goes on. DIR/study.html shows every table beside the thesis's own, and says
where both agree, where not, and why (docs/study.md)."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "study", run, _TEXT)
    parser.add_argument(
        "motions", metavar="MOTION.bvh", nargs="*", type=Path, help="motions (default: the thesis's four)"
    )
    parser.add_argument("--seeds", metavar="N", type=int, default=3, help="seeds per motion (default 3)")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for tables and plots")
    parser.add_argument(
        "--cameras",
        metavar="1,2,3,4",
        type=_counts,
        default=(1, 2, 3, 4),
        help="numbers of cameras (default all)",
    )
    parser.add_argument(
        "--votes", metavar="DIR", type=Path, help="blind tests: sessions/blind, or one test's folder"
    )
    parser.add_argument("--unit-m", metavar="M", type=float, help="metres per unit of BVH motions")
    parser.add_argument("--short", action="store_true", help="only what the thesis's tables need")
    parser.add_argument("--processes", metavar="N", type=int, help="how many at once (default: one a core)")
    add_json(parser)


def _counts(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not like 1,2,3") from None


def run(args: argparse.Namespace) -> int:
    from studio.commands.common import write_result
    from studio.engine.errors import SettingsError
    from studio.study.decision import decision_rows, decisions
    from studio.study.page import write_study
    from studio.study.plan import make_plan
    from studio.study.results import Results
    from studio.study.run import read_cells, run_study
    from studio.study.tables import table_json, table_text
    from studio.study.thesis_tables import TABLES
    from studio.study.votes import read_votes

    if args.processes is not None and args.processes < 1:
        raise SettingsError(f"--processes {args.processes}: give at least 1")
    votes = {} if args.votes is None else read_votes(args.votes)
    study = make_plan(
        tuple(args.motions), cameras=args.cameras, seeds=args.seeds, unit_m=args.unit_m, short=args.short
    )
    with progress_bar("study") as progress:
        made = run_study(study, args.out, processes=args.processes, progress=progress)
    cells = read_cells(study, args.out)
    page = write_study(study, cells, votes, args.out)
    results = Results(cells)
    shown = [one for one in TABLES if any(results.of(condition) for condition in one.conditions)]
    for one in shown:
        print(table(table_text(one, results)), end="\n\n")
    rows = decisions(results, votes)
    print(table(decision_rows(rows)), end="\n\n")
    write_result(args, {"tables": [table_json(one, results) for one in shown], "decision": rows})
    print(f"the thesis's figures are in brackets; {made} of {len(cells)} solves were made now")
    print(f"{page}: all of it, with plots and words")
    return 0

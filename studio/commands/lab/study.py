"""`studio study`: the thesis's experiments."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_json, progress_bar, table

_TEXT = """\
Repeat the thesis's experiments over motions, cameras and seeds, as tables and plots.

Simulated cameras watch the thesis's four movements of the arms, or the given animations. Each recording is
solved with one switch changed at a time, and measured against the truth. DIR keeps the results, so that a study that
was interrupted, or needs more seeds, continues. DIR/study.html shows every table beside the thesis's own, and
explains agreements and differences (docs/study.md)."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "study", run, _TEXT)
    parser.add_argument(
        "motions", metavar="MOTION.bvh", nargs="*", type=Path, help="motions (default: the thesis's four)"
    )
    parser.add_argument("--seeds", metavar="N", type=int, default=3, help="seeds per motion (default 3)")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder of tables and plots")
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
    parser.add_argument(
        "--processes", metavar="N", type=int, help="number of processes (default: one per core)"
    )
    add_json(parser)


def _counts(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not like 1,2,3") from None


def run(args: argparse.Namespace) -> int:
    from studio.commands.common import write_result
    from studio.engine.base.errors import SettingsError
    from studio.lab.study.decision import decision_rows, decisions
    from studio.lab.study.page import write_study
    from studio.lab.study.plan import make_plan
    from studio.lab.study.results import Results
    from studio.lab.study.run import read_cells, run_study
    from studio.lab.study.tables import table_json, table_text
    from studio.lab.study.thesis_tables import TABLES
    from studio.lab.study.votes import read_votes

    if args.processes is not None and args.processes < 1:
        raise SettingsError("study.processes", "--processes {n}: give at least 1", n=args.processes)
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

"""`studio picture`: frames of solves drawn as a strip."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_take

_TEXT = """\
Draw frames of a take's solves as a picture, one row per solve."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "picture", run, _TEXT)
    add_take(parser)
    parser.add_argument("--out", metavar="FILE.png", type=Path, required=True, help="the picture to write")
    parser.add_argument(
        "--solve",
        metavar="NAME",
        action="extend",
        nargs="+",
        default=[],
        help="solves to draw (default: the best)",
    )
    parser.add_argument("--times", metavar="S,S,...", type=_numbers, help="stage times to draw [s]")
    parser.add_argument(
        "--count", metavar="N", type=int, default=8, help="how many frames without --times (default 8)"
    )
    parser.add_argument(
        "--yaw", metavar="DEG", type=float, default=25.0, help="0 = from the front, 90 = from the left"
    )


def _numbers(text: str) -> list[float]:
    """Return the numbers of `1,2.5,3` (an argparse type)."""
    return [float(part) for part in text.split(",")]


def run(args: argparse.Namespace) -> int:
    from studio.commands.export import choose_solve
    from studio.engine.poses import Poses
    from studio.render.strip import render_strip
    from studio.take.take import Take

    take = Take.open(args.take)
    wanted = list(dict.fromkeys(args.solve)) or [None]
    names = [choose_solve(take.solve_names(), name, str(take.path)) for name in wanted]
    rows = {name: Poses.load(take.solve_folder(name) / "poses.npz") for name in names}
    render_strip(rows, args.out, times_s=args.times, count=args.count, yaw_deg=args.yaw)
    print(f"{args.out}: {', '.join(names)}")
    return 0

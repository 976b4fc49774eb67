"""`studio picture`: frames of solves as a strip, or as a moving picture."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_take
from studio.engine.model.performers.bodies import BODIES

_TEXT = """\
Draw frames of a take's solves as a picture, one row per solve; or, as FILE.gif, moving, one solve beside the other.

--times are stage times, as in poses.npz and evaluate --json. In a live take, whose stage clock is a wall clock, they
count from the first frame. The picture shows the time since the performance began, as the replay does. A moving
picture goes from the first to the last of them, 30 s at most."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "picture", run, _TEXT)
    add_take(parser)
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="the picture to write, .png or .gif"
    )
    parser.add_argument(
        "--solve",
        metavar="NAME",
        action="extend",
        nargs="+",
        default=[],
        help="solves to draw (default: the best)",
    )
    parser.add_argument("--performer", metavar="NAME", help="of several only this one (default: all)")
    parser.add_argument(
        "--times", metavar="S,S,...", type=_numbers, help="stage times to draw [s]; see above"
    )
    parser.add_argument(
        "--count", metavar="N", type=int, default=8, help="number of frames without --times (default 8)"
    )
    parser.add_argument(
        "--body", choices=BODIES, default=BODIES[0], help=f"the mannequin's body (default {BODIES[0]})"
    )
    parser.add_argument(
        "--yaw", metavar="DEG", type=float, default=25.0, help="0 = from the front, 90 = from the left"
    )


def _numbers(text: str) -> list[float]:
    """Return the numbers of `1,2.5,3` (an argparse type)."""
    return [float(part) for part in text.split(",")]


def run(args: argparse.Namespace) -> int:
    from studio.library import choose_solve
    from studio.review.render.moving import render_moving
    from studio.review.render.strip import render_strip, stage_times
    from studio.take.folder.solved import solved_performers
    from studio.take.folder.take import Take

    take = Take.open(args.take)
    wanted = list(dict.fromkeys(args.solve)) or [None]
    names = [choose_solve(take.solve_names(), name, str(take.path)) for name in wanted]
    rows = {name: [one.poses for one in solved_performers(take, name, args.performer)] for name in names}
    first = min(rows[names[0]], key=lambda poses: poses.begins_s)
    times_s = None if args.times is None else stage_times(first, args.times)
    if args.out.suffix.lower() == ".gif":
        span_s = None if times_s is None else (min(times_s), max(times_s))
        render_moving(rows, args.out, span_s=span_s, yaw_deg=args.yaw, body=args.body)
    else:
        render_strip(rows, args.out, times_s=times_s, count=args.count, yaw_deg=args.yaw, body=args.body)
    print(f"{args.out}: {', '.join(names)}; the performance begins at stage time {first.begins_s:.2f} s")
    return 0

"""`studio splice`: parts of takes as one new take, and loops."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, figure, progress_bar, table, write_result

if TYPE_CHECKING:
    from studio.offline.edits.take_parts import TakePart

_TEXT = """\
Splice parts of takes of one performer into a new take, or loop a part.

The end of each part is blended into the begin of the next, which is turned and moved onto its way; standing feet stay
on the floor. The new take has no raw frames, but the solve `spliced`, and remembers its parts.

  studio splice takes/walk takes/run --out takes/walk_run
  studio splice takes/walk@36-41.5 takes/walk@60- --out takes/cut --blend 1.2
  studio splice takes/walk@36-38 --times 4 --out takes/loop

Times are stage times, as in poses.npz; in a live take they count from the first frame."""

_SPAN = re.compile(r"(.+)@(\d*\.?\d*)-(\d*\.?\d*)", re.DOTALL)


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "splice", run, _TEXT)
    add = parser.add_argument
    add(
        "parts",
        metavar="TAKE[@FROM-TO]",
        nargs="+",
        help="a take, or a part of it [s]; either time may be left out",
    )
    add("--out", metavar="TAKE", type=Path, required=True, help="folder of the new take")
    add(
        "--solve",
        metavar="NAME",
        help="the solve of all takes (default: finish, studio, live, or the first by name)",
    )
    add("--performer", metavar="NAME", help="of takes of several performers this one (default: the first)")
    add("--times", metavar="N", type=int, default=1, help="how often all parts come, for a loop (default 1)")
    add("--blend", metavar="S", type=float, help="length of each seam (default 0.8 s)")
    add("--near", metavar="S", type=float,
        help="each begin is moved by up to this, to where it is most like the end before it; 0 leaves it "
        "(default 0.6 s)")  # fmt: skip
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.library import splice
    from studio.offline.edits.take_parts import BLEND_S, NEAR_S

    parts = [_part(text, args.solve, args.performer) for text in args.parts]
    with progress_bar("splice") as progress:
        take = splice(
            parts, args.out, times=args.times, progress=progress,
            blend_s=BLEND_S if args.blend is None else args.blend,
            near_s=NEAR_S if args.near is None else args.near,
        )  # fmt: skip
    used = take.meta.get("parts", [])
    write_result(args, {"take": str(take.path), "parts": used})
    rows = [["take", "solve", "from s", "to s"]]
    rows += [[one["take"], one["solve"], figure(one["start_s"], 2), figure(one["end_s"], 2)] for one in used]
    print(table(rows))
    print(f"{take.path}: solve spliced")
    return 0


def _part(text: str, solve: str | None, performer: str | None) -> "TakePart":
    """Return the part of a take that an argument names.

    Raises:
        TakeError: there is no such take.
    """
    from studio.engine.model.poses import Poses
    from studio.library import choose_solve
    from studio.offline.edits.take_parts import TakePart
    from studio.review.render.strip import stage_time
    from studio.take.folder.take import POSES, Take

    found = None if Path(text).is_dir() else _SPAN.fullmatch(text)
    take = Take.open(text if found is None else found[1])
    if found is None:
        return TakePart(take, solve=solve, performer=performer)
    name = choose_solve(take.solve_names(), solve, str(take.path))
    begins_s = Poses.load(take.performer_folder(name, performer) / POSES).begins_s
    start_s, end_s = (
        stage_time(begins_s, float(one)) if one.strip(".") else None for one in found.group(2, 3)
    )
    return TakePart(take, start_s, end_s, name, performer)

"""`studio performers`: the performers of a take, their names, and their exchange from a moment on."""

import argparse
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, add_take, figure, table, write_result

if TYPE_CHECKING:
    from studio.engine.model.performers.exchange import Exchange
    from studio.take.folder.take import Take

_TEXT = """\
Show the performers of a take of several, name them, or exchange two of them from a moment on.

An exchange mends a take in which two performers became one another. It is kept with the take and used by every
further `studio solve`, which it does not start; raw frames do not change. --undo takes the last one back. Times are
stage times, as in poses.npz; in a live take they count from the first frame."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "performers", run, _TEXT)
    add_take(parser)
    add = parser.add_argument
    add("--name", metavar="PERFORMER=NAME", action="append", default=[],
        help="name a performer, such as performer_1=Ana; without a NAME theirs is removed")  # fmt: skip
    add("--exchange", metavar="PERFORMER", nargs=2, help="exchange these two from --at on")
    add("--at", metavar="S", type=float, help="time of the exchange [s]")
    add("--undo", action="store_true", help="take the last exchange back")
    add("--solve", metavar="NAME", help="whose performers (default: finish, studio, live, or the first)")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.library import choose_solve
    from studio.take.folder.performers import exchanges_of, shown_name
    from studio.take.folder.take import PERFORMER, POSES, Take

    take = Take.open(args.take)
    solve = choose_solve(take.solve_names(), args.solve, str(take.path))
    _change(args, take, solve)
    performers = []
    for performer in take.performer_names(solve) or [PERFORMER]:
        folder = take.performer_folder(solve, performer)
        name = shown_name(take.meta, performer)
        performers.append({"performer": performer, "name": name, **_figures(folder / POSES)})
    exchanges = exchanges_of(take.meta)
    write_result(
        args,
        {
            "solve": solve,
            "performers": performers,
            "exchanges": [{"time_s": one.time_s, "performers": list(one.performers)} for one in exchanges],
        },
    )
    rows = [["performer", "name", "frames", "from s", "to s", "undecided s"]]
    rows += [
        [one["performer"], one["name"], str(one["frames"]),
         *(figure(one[key], 2) for key in ("from_s", "to_s", "undecided_s"))]
        for one in performers
    ]  # fmt: skip
    print(f"solve {solve}:\n{table(rows)}")
    for one in exchanges:
        print(f"exchanged from {one.time_s:.2f} s on: {' and '.join(one.performers)}")
    if args.exchange or args.undo:
        print(f"run `studio solve {take.path}` to have it in a solve")
    return 0


def _figures(file: Any) -> dict[str, Any]:
    from studio.engine.model.poses import Poses
    from studio.take.folder.solves import undecided_spans

    poses = Poses.load(file)
    return {
        "frames": poses.frame_count,
        "from_s": float(poses.time_s[0]),
        "to_s": float(poses.time_s[-1]),
        "undecided_s": sum(end - begin for begin, end in undecided_spans(file.parent)),
    }


def _change(args: argparse.Namespace, take: "Take", solve: str) -> None:
    """Store the requested changes in the take.

    Raises:
        SettingsError: half of an exchange was given.
        TakeError: a name or performer that is not allowed.
    """
    from studio.engine.base.errors import SettingsError
    from studio.take.folder.performers import (
        checked_exchanges,
        checked_names,
        exchanges_of,
        performer_by_name,
    )

    if (args.exchange is None) != (args.at is None):
        raise SettingsError(
            "performers.half", "--exchange and --at go together: who is exchanged, and from when on"
        )
    names = dict(take.meta.get("performer_names", {}))
    for given in args.name:
        performer, _, name = given.partition("=")
        names[performer_by_name(take.meta, performer)] = name
    take.meta["performer_names"] = checked_names(names)
    exchanges = list(exchanges_of(take.meta))
    if args.undo and not exchanges:
        raise SettingsError("performers.nothing_to_undo", "this take has no exchange to take back")
    if args.undo:
        exchanges.pop()
    if args.exchange is not None:
        exchanges.append(_exchange(args, take, solve))
    if args.name or args.undo or args.exchange is not None:
        take.meta["exchanges"] = checked_exchanges(exchanges)
        take.save_meta()


def _exchange(args: argparse.Namespace, take: "Take", solve: str) -> "Exchange":
    from studio.engine.model.performers.exchange import Exchange
    from studio.engine.model.poses import Poses
    from studio.review.render.strip import stage_times
    from studio.take.folder.performers import performer_by_name
    from studio.take.folder.take import POSES

    first, second = (performer_by_name(take.meta, name) for name in args.exchange)
    folders = [take.performer_folder(solve, name) for name in (first, second)]  # reports a missing performer
    (at_s,) = stage_times(Poses.load(folders[0] / POSES), [args.at])
    return Exchange(at_s, (first, second))

"""`studio solve`: a take's raw frames through the pipeline, with any settings."""

import argparse
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, add_take, progress_bar, write_result

if TYPE_CHECKING:
    from studio.engine.model.settings.settings import SolveSettings
    from studio.take.folder.take import Take

_TEXT = """\
Solve a take again from its raw frames, with the settings of a preset and any switches.

The result is solves/<name> of the take: settings.json, poses.npz and metrics.json; solving again under the
same name replaces it. The edits of the take are honoured (`studio edit`). --as-live repeats the decisions of the
live stage, without them."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "solve", run, _TEXT)
    add_take(parser)
    parser.add_argument(
        "--preset",
        metavar="NAME",
        default="studio",
        help="raw, thesis, studio, finish, or one saved in the studio (default studio)",
    )
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="change a switch, such as smoothing=one_euro:before; an unknown one lists what is allowed",
    )
    parser.add_argument(
        "--name", metavar="SOLVE", help="name of the solve (default: the preset's; live for --as-live)"
    )
    parser.add_argument(
        "--as-live", action="store_true", help="repeat the live stage's decisions bit for bit"
    )
    parser.add_argument(
        "--no-edits", action="store_true", help="without the edits of the take (`studio edit`)"
    )
    parser.add_argument(
        "--auto",
        action="store_true",
        help="also try the offered edits of all clean-up events; keep those that remove their event, make no "
        "other and move nothing else by over 5 mm",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.take.library.presets import Presets

    if args.auto and (args.as_live or args.no_edits):
        raise SettingsError(
            "edits.auto", "--auto makes edits: it goes with neither --as-live nor --no-edits; leave one out"
        )
    settings = Presets(args.take.resolve().parent.parent).settings(args.preset, args.set)

    from studio.offline.replay import solve_take
    from studio.take.folder.take import Take

    take = Take.open(args.take)
    if args.auto:
        _mend(take, settings)
    name = args.name or ("as-live" if args.as_live else args.preset)
    with progress_bar("solve") as progress:
        folder = solve_take(
            take, settings, name=name, as_live=args.as_live, progress=progress,
            edits=() if args.no_edits else None,
        )  # fmt: skip
    return _report(args, folder)


def _mend(take: "Take", settings: "SolveSettings") -> None:
    from studio.offline.edits.mend import mend

    with progress_bar("mend") as progress:
        mended = mend(take, settings, progress=progress)
    print(
        f"clean-up events: {mended.before} before, {mended.after} after {len(mended.edits)} edits; `studio edit "
        f"{take.path} undo` takes them back"
    )


def _report(args: argparse.Namespace, folder: Any) -> int:
    from studio.take.folder.solves import read_metrics

    metrics = read_metrics(folder) or {}
    write_result(args, {"solve": folder.name, **metrics})
    print(f"solve {folder.name}: {folder}")
    for key, value in metrics.items():
        if isinstance(value, int | float | str):
            print(f"  {key}: {value:.4g}" if isinstance(value, float) else f"  {key}: {value}")
    for id_, edit in metrics.get("edits", {}).items():
        print(f"  edit {id_}: {edit.get('line') or 'honoured'}")
        for found in edit.get("mended", ()):
            cameras = ", ".join(found["cameras"]) or "no camera saw it"
            print(
                f"    mended: {', '.join(found['joints'])} ({cameras}), "
                f"{found['start_s']:.2f} to {found['end_s']:.2f} s{', a guess' if found['guessed'] else ''}"
            )
            for one in found["exchanges"]:
                print(f"    {one['camera']} exchanges left and right at {one['time_s']:.2f} s")
    return 0

"""`studio batch`: solve, export or evaluate many takes."""

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from studio.commands.common import add_command, add_json, progress_bar, write_result
from studio.engine.base.value_sentences import bad_value

_TEXT = """\
Solve, export or evaluate many takes, on all cores or on a Dask cluster.

  studio batch solve SESSIONS --preset finish
  studio batch export SESSIONS --solve finish --format fbx --out FOLDER
  studio batch evaluate SESSIONS --solve finish --out FOLDER

SESSIONS is a take, a session or a folder of sessions; several may be given. Existing results of the same input and
settings are reused. A take's reference is TAKE.truth.csv beside it, or in its references/."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "batch", run, _TEXT)
    add = parser.add_argument
    add("work", choices=("solve", "export", "evaluate"), help="the work on each take")
    add("folders", metavar="SESSIONS", type=Path, nargs="+", help="takes, sessions or folders of sessions")
    add("--preset", default="studio", help="of solves (default studio)")
    add(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="a switch of solves; may be given again",
    )
    add("--name", metavar="SOLVE", help="name of solves (default: the preset's)")
    add(
        "--solve",
        metavar="NAME",
        default="finish",
        help="solve to export or evaluate (default finish)",
    )
    add(
        "--format",
        default="fbx",
        choices=("fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd"),
        help="of exports",
    )
    add("--target", default="humanik", choices=("humanik", "mixamo", "unreal", "vrm"), help="of exports")
    add("--fps", metavar="F", type=float, help="frames per second of exports")
    add("--out", metavar="DIR", type=Path, help="folder of exports or evaluations")
    add(
        "--processes",
        metavar="N",
        type=int,
        default=os.cpu_count() or 1,
        help="number of processes (default: one per core)",
    )
    add("--scheduler", metavar="URL", help="use a Dask cluster, such as tcp://10.0.0.5:8786")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.offline.batch.jobs import Done, summary
    from studio.offline.batch.run import run_jobs

    if args.processes < 1:
        raise SettingsError(bad_value("--processes", args.processes, "1 or more"))
    jobs = _jobs(args)
    with progress_bar(f"{args.work} {len(jobs)} takes") as progress:

        def told(done: Done, ended: int, total: int) -> None:
            if done.state == "failed":
                print(f"{done.take}: {done.message}", file=sys.stderr)
            if progress is not None:
                progress(ended / total)

        done = run_jobs(jobs, processes=args.processes, scheduler=args.scheduler, told=told)
    result = summary(done)
    print(f"{result.done} done, {result.skipped} done before, {result.failed} failed")
    write_result(args, to_builtins(result))
    return 1 if result.failed else 0


def _jobs(args: argparse.Namespace) -> list[Any]:
    from studio.engine.base.errors import SettingsError, TakeError
    from studio.engine.model.settings.settings import parse_settings
    from studio.offline.batch.jobs import BatchJob

    takes = find_takes(args.folders)
    if not takes:
        raise TakeError("batch.no_take", "there is no take in {folders}", folders=[*args.folders])
    if args.work == "solve":
        settings = parse_settings(args.preset, args.set).to_json()
        options = {"settings": settings, "name": args.name or args.preset}
        return [BatchJob("solve", str(take), options) for take in takes]
    if args.out is None:
        raise SettingsError(
            "batch.no_out", "batch {work} needs --out DIR, the folder of its files", work=args.work
        )
    jobs = []
    for take in takes:
        stem = f"{take.parent.name}_{take.name}_{args.solve}"
        if args.work == "export":
            options = {"fps": args.fps, "target": args.target, "take_name": take.name}
            out = str(args.out.resolve() / f"{stem}.{args.format}")
            jobs.append(
                BatchJob(
                    "export",
                    str(take),
                    {"solve": args.solve, "format": args.format, "out": out, "options": options},
                )
            )
        else:
            reference = find_reference(take)
            out = str(args.out.resolve() / f"{stem}.json")
            jobs.append(
                BatchJob(
                    "evaluate", str(take), {"solve": args.solve, "reference": str(reference), "out": out}
                )
            )
    return jobs


def find_takes(folders: list[Path]) -> list[Path]:
    """Return the takes at or below the folders, each once, by path."""
    found = set()
    for folder in folders:
        for depth in ("take.json", "*/take.json", "*/*/take.json"):
            found |= {path.parent.resolve() for path in folder.glob(depth)}
    return sorted(found)


def find_reference(take: Path) -> Path:
    """Return a take's reference: the ground truth next to it, or the first file in its references."""
    beside = take.with_name(take.name + ".truth.csv")
    kept = sorted((take / "references").glob("*"))
    return kept[0] if not beside.is_file() and kept else beside

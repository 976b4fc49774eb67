"""`studio bench`: how fast every stage is on this machine."""

import argparse
from typing import Any

from studio.commands.common import add_command, add_json, progress_bar, table, write_result

_TEXT = """\
Measure the speed of every stage, each on one core, on the embedded simulated stage.

The whole live pipeline is `pipeline`. The solvers are compared with plain mink, one FrameTask per joint, on
the same model and motion in the same run."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "bench", run, _TEXT)
    parser.add_argument("--frames", metavar="N", type=int, default=300, help="frames per stage (default 300)")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.bench.run import run_bench
    from studio.engine.errors import SettingsError

    if args.frames < 30:
        raise SettingsError(f"--frames {args.frames} is too few; allowed: 30 or more")
    with progress_bar("bench") as progress:
        stages = run_bench(args.frames, progress=progress)
    write_result(args, {"stages": stages})
    print(summary(stages))
    return 0


def summary(stages: dict[str, dict[str, float | None]]) -> str:
    """The stages as a table, one line each."""
    rows = [["stage", "median ms", "p99 ms", "frames/s", "time / plain mink's"]]
    for name, stage in stages.items():
        ratio = stage.get("ratio_to_mink_frame_tasks")
        rows.append(
            [
                name,
                f"{stage['median_ms']:.3f}",
                f"{stage['p99_ms']:.3f}",
                f"{stage['frames_per_second']:.0f}",
                "" if ratio is None else f"{ratio:.2f}",
            ]
        )
    return table(rows)

"""`studio bench`: the speed of every stage on this machine."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, progress_bar, table, write_result

if TYPE_CHECKING:
    from studio.lab.bench.timing import StageTiming

_TEXT = """\
Measure the speed of every stage, each on one core, on the embedded simulated stage.

The whole live pipeline is `pipeline`. The solvers are compared with plain mink, one FrameTask per joint, on
the same model and motion in the same run, and with mink in the set-up of General Motion Retargeting. --growth also
measures the time of the pipeline by cameras (1 to 8) and joints, and of a finished take by length."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "bench", run, _TEXT)
    parser.add_argument("--frames", metavar="N", type=int, default=300, help="frames per stage (default 300)")
    parser.add_argument("--growth", action="store_true", help="measure growth too (a few minutes)")
    parser.add_argument("--report", metavar="FILE.html", type=Path, help="write tables and plots as a page")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.engine.base.files import write_atomically
    from studio.engine.base.system import peak_memory_bytes
    from studio.lab.bench.growth import growth
    from studio.lab.bench.report import bench_report
    from studio.lab.bench.run import run_bench

    if args.frames < 30:
        raise SettingsError("bench.few_frames", "--frames {n} is too few; allowed: 30 or more", n=args.frames)
    with progress_bar("bench") as progress:
        stages = run_bench(args.frames, progress=progress)
    result: dict[str, Any] = {"stages": stages, "peak_memory_mb": peak_memory_bytes() / 2**20}
    if args.growth:
        result["growth"] = growth(args.frames)
    write_result(args, result)
    if args.report is not None:
        with write_atomically(args.report) as file:
            file.write(bench_report(result).encode())
    print(summary(stages))
    two = stages["pipeline_2_of_4"].get("ratio_to_one_performer", 0.0)
    print(f"two performers before four cameras: {two:.2f} times the time of one")
    for name, points in result.get("growth", {}).items():
        print(f"{name}: " + ", ".join(f"{at}: {told(point)}" for at, point in points.items()))
    return 0


def told(point: dict[str, Any]) -> str:
    """A point of the growth curve in words."""
    if "solve_s" in point:
        return f"{point['frames_per_second']:.0f} frames/s, {point['peak_memory_mb']:.0f} MB"
    median, p99, cpu = (1e3 * point[key] for key in ("median_ms", "p99_ms", "cpu_p99_ms"))
    return f"median {median:.0f} us, p99 {p99:.0f} us ({cpu:.0f} of processor time)"


def summary(stages: dict[str, "StageTiming"]) -> str:
    """The stages as a table, one line each."""
    rows = [["stage", "median us", "p99 us", "p99 cpu us", "frames/s", "time / plain mink's"]]
    for name, stage in stages.items():
        ratio = stage.get("ratio_to_mink_frame_tasks")
        rows.append(
            [
                name,
                f"{1e3 * stage['median_ms']:.1f}",
                f"{1e3 * stage['p99_ms']:.1f}",
                f"{1e3 * stage['cpu_p99_ms']:.1f}",
                f"{stage['frames_per_second']:.0f}",
                "" if ratio is None else f"{ratio:.2f}",
            ]
        )
    return table(rows)

"""`studio calibrate`: where the cameras stand, how their clocks run, how tall the performer is."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_json, add_take, figure, table, write_result

_TEXT = """\
Find the cameras' places and clocks and the performer's proportions from a take's own frames.

Uses the calibration part at the take's beginning (a T-pose, then a walk) where the take says how long it
is, else all of it. The result is the take's next numbered calibration and is used from then on. A calibration
that is refused is kept too, with its reasons, but not used; the command then exits 1. A take that has only depth
is tracked first, and its cameras are refined on the body and the floor."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "calibrate", run, _TEXT)
    add_take(parser)
    parser.add_argument(
        "--reference", metavar="CAMERA", help="the camera that gives the stage clock (default: the first)"
    )
    parser.add_argument(
        "--from",
        dest="borrow",
        metavar="OTHER",
        type=Path,
        help="borrow another take's calibration, of the same cameras, instead; clocks stay the take's own",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.take.borrow import borrow_calibration
    from studio.take.take import Take
    from studio.tracking import calibrate_take, keep_calibration

    take = Take.open(args.take)
    if args.borrow is not None:
        number = borrow_calibration(take, Take.open(args.borrow))
        write_result(args, take.calibration().to_json())
        print(f"calibration {number} is in use, from {args.borrow}: {take.calibration_path(number)}")
        return 0
    calibration = calibrate_take(take, reference=args.reference)
    result = calibration.to_json()
    write_result(args, result)
    print(_summary(result))
    number = keep_calibration(take, calibration)
    print(f"calibration {number} is in use: {take.calibration_path(number)}")
    return 0


def _summary(result: dict[str, Any]) -> str:
    """The calibration as a table, one line per camera."""
    rows = [["camera", "median mm", "p95 mm", "pairs", "clock ms", "drift ppm", "coverage", "verdict"]]
    for name, camera in result["cameras"].items():
        rows.append(
            [
                name,
                figure(camera["residual_median_mm"]),
                figure(camera["residual_p95_mm"]),
                str(camera["residual_pairs"]),
                figure(camera["time_offset_ms"]),
                figure(camera["clock_drift_ppm"]),
                figure(camera["coverage"], 2),
                camera["verdict"],
            ]
        )
    lines = [table(rows)]
    if result["performer"] is not None:
        lines.append(f"performer: {result['performer']['height_m']:.2f} m tall")
    return "\n".join(lines)

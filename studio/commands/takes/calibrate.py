"""`studio calibrate`: camera poses, clocks, and the performer's height."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_json, add_take, figure, table, write_result

if TYPE_CHECKING:
    from studio.engine.calibration.board import BoardFound
    from studio.engine.model.calibration import CalibrationJson

_TEXT = """\
Find the cameras' poses and clocks and the performer's proportions from a take's own frames.

Uses the calibration part at the take's beginning (a T-pose, then a walk) if its length is known, else the whole
take. The result is the take's next numbered calibration and is used from then on. A refused calibration is stored
too, with its reasons, but not used; the command then exits 1. Spans in which cameras do not agree are left out and
reported, if at least 20 s agree; the end of a calibration part must agree. A take with only depth is tracked first,
and its cameras are refined on the body and the floor."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "calibrate", run, _TEXT)
    add_take(parser)
    parser.add_argument(
        "--reference", metavar="CAMERA", help="the camera whose clock is the stage clock (default: the first)"
    )
    parser.add_argument(
        "--height-m",
        metavar="M",
        type=float,
        help="the performer's height without shoes; where no camera sees depth, it gives the size of the stage "
        "(default: 1.75 in shoes)",
    )
    parser.add_argument(
        "--lens",
        metavar="[CAMERA=]FILE",
        action="append",
        default=[],
        help="the lens of a camera without depth, or the lenses of all that the file names: JSON of a calibration, "
        ".toml of Pose2Sim or FreeMoCap; may be given several times",
    )
    parser.add_argument(
        "--focal-px",
        metavar="[CAMERA=]PIXELS",
        action="append",
        default=[],
        help="its focal length alone, such as left=1640 or left=1640+-30; without a camera, that of all",
    )
    parser.add_argument(
        "--fov-deg",
        metavar="[CAMERA=]DEGREES",
        action="append",
        default=[],
        help="the same by the field of view along the picture's longer side, such as 65+-2",
    )
    parser.add_argument(
        "--same-lens", action="store_true", help="cameras whose lens is not given have one focal length"
    )
    parser.add_argument(
        "--readout-ms",
        metavar="[CAMERA=]MS",
        action="append",
        default=[],
        help="time in which a camera without depth reads a picture from the first row to the last (rolling shutter), "
        "such as phone=22; without a camera, that of all (default: 0)",
    )
    parser.add_argument(
        "--board",
        metavar="BOARD",
        help="a board in the take's videos that gives cameras without depth the size of the stage and, where it lies "
        "on the floor, floor and origin: charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM[:DICTIONARY], or "
        "apriltag:SIZE_MM[:FAMILY]",
    )
    parser.add_argument(
        "--from",
        dest="borrow",
        metavar="OTHER",
        type=Path,
        help="use another take's calibration of the same cameras; the take keeps its own clocks",
    )
    parser.add_argument(
        "--use",
        metavar="NUMBER",
        type=int,
        help="have this stored calibration in use again, and make no new one",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.commands.takes.lenses import given_lenses, given_readouts
    from studio.engine.seeing.board import Board
    from studio.offline.board import calibrated_by_board
    from studio.offline.tracking import calibrate_take, keep_calibration
    from studio.take.folder.take import Take
    from studio.take.library.borrow import borrow_calibration, use_calibration

    take = Take.open(args.take)
    if args.use is not None:
        use_calibration(take, args.use)
        write_result(args, take.calibration().to_json())
        print(f"calibration {args.use} is in use: {take.calibration_path(args.use)}")
        return 0
    if args.borrow is not None:
        number = borrow_calibration(take, Take.open(args.borrow))
        write_result(args, take.calibration().to_json())
        print(f"calibration {number} is in use, from {args.borrow}: {take.calibration_path(number)}")
        return 0
    board = None if args.board is None else Board.parse(args.board)
    calibration = calibrate_take(
        take,
        reference=args.reference,
        height_m=args.height_m,
        lenses=given_lenses(args, take.camera_names),
        same_lens=args.same_lens,
        readouts_ms=given_readouts(args.readout_ms, take.camera_names),
    )
    said = ""
    if board is not None and not calibration.refused:
        calibration, found = calibrated_by_board(take, calibration, board, height_m=args.height_m)
        said = _board_line(found)
    result = calibration.to_json()
    write_result(args, result)
    print(_summary(result) + said)
    number = keep_calibration(take, calibration)
    print(f"calibration {number} is in use: {take.calibration_path(number)}")
    return 0


def _board_line(found: "BoardFound") -> str:
    """The facts about a board, as one line."""
    floor = "the floor stays that of the feet"
    if found.on_floor:
        raised_mm = 1e3 * found.raised_m
        floor = (
            f"floor and origin by it (turned by {found.tilt_deg:.1f} degrees, raised by {raised_mm:.0f} mm)"
        )
    return (
        f"\nboard: seen by {', '.join(found.cameras)} {found.sightings} times together; size x {found.size:.4f}, "
        f"sure to {1e2 * found.spread:.1f} %; {floor}"
    )


def _summary(result: "CalibrationJson") -> str:
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
        lines.append(f"performer: {result['performer']['height_m']:.2f} m tall in shoes")
    lines += [
        f"{name}: {reason}"
        for name, camera in result["cameras"].items()
        if camera["verdict"] == "usable"
        for reason in camera["reasons"]
    ]
    return "\n".join(lines)

"""`studio board`: a board to be printed."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command

_TEXT = """\
Draw a board, or an AprilTag, in true size, to be printed.

Filmed by two cameras without depth, it says how large the stage is and, on the floor, where floor and origin are:
`studio calibrate TAKE --board BOARD`. Print at 100 %, glue it onto something stiff, and measure it: what counts is
the measured size."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "board", run, _TEXT)
    parser.add_argument(
        "board",
        metavar="BOARD",
        help="charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM[:DICTIONARY], or apriltag:SIZE_MM[:FAMILY]",
    )
    parser.add_argument("--number", metavar="N", type=int, default=0, help="of the AprilTag (default: 0)")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the SVG to write")


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.files import write_atomically
    from studio.engine.seeing.board import Board
    from studio.engine.seeing.board_sheet import board_sheet

    sheet = board_sheet(Board.parse(args.board), args.number)
    with write_atomically(args.out) as out:
        out.write(sheet.encode())
    print(f"{args.out}: print it at 100 %, and measure it")
    return 0

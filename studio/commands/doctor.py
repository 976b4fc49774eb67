"""`studio doctor`: checks the install and the takes."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_json

_TEXT = """\
Check the install and every take in a folder, and recover what a crash left.

Raw recordings are never changed. Exits 1 when something is wrong that could not be mended."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "doctor", run, _TEXT)
    parser.add_argument(
        "folder",
        metavar="DIR",
        nargs="?",
        type=Path,
        default=Path("sessions"),
        help="folder of takes (default sessions)",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from studio.take.doctor import examine

    return examine(args.folder)

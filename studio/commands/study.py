"""`studio study`: the thesis's experiments."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command

_TEXT = """\
Repeat the thesis's experiments over motions, cameras and seeds, as tables and plots.

Not available in this version."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "study", run, _TEXT)
    parser.add_argument(
        "motions", metavar="MOTION.bvh", nargs="*", type=Path, help="motions (default: the thesis's four)"
    )
    parser.add_argument("--seeds", metavar="N", type=int, default=3, help="seeds per motion")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for tables and plots")


def run(args: argparse.Namespace) -> int:
    from studio.engine.errors import NotAvailableError

    raise NotAvailableError("study is not available in this version")

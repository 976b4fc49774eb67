"""`studio prepare`: compiles in advance what the first takes call."""

import argparse
import sys
from typing import Any

from studio.commands.common import add_command, progress_bar

_TEXT = """\
Compile ahead what the first takes call, once after installation.

Without it, the first pose of the live stage, the first solve and the first depth camera compile what they call, and
wait for it. `./start` does it after every installation and update. The result is kept beside the program, or in the
user's cache folder."""


def add_parser(subparsers: Any) -> None:
    add_command(subparsers, "prepare", run, _TEXT)


def run(args: argparse.Namespace) -> int:
    from studio.offline.compiling import compile_ahead

    print("Compiling the solver (once, about a minute) ...", file=sys.stderr, flush=True)
    with progress_bar("Compiling") as progress:
        compile_ahead(progress)
    return 0

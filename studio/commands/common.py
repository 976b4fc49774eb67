"""Shared by several commands: `--json`, `--set`, tables, and a progress bar on a terminal."""

import argparse
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

Progress = Callable[[float], None]
"""Receives the share done, 0..1."""

_ASSIGNMENT = re.compile(r"[A-Za-z_][\w.]*=.*", re.DOTALL)


def add_command(subparsers: Any, name: str, run: Callable[..., int], text: str) -> argparse.ArgumentParser:
    """Return a new command's parser; `text` describes it, with its first line in the list of commands."""
    first, _, _ = text.partition("\n")
    parser = subparsers.add_parser(
        name,
        help=first.rstrip(".").replace("%", "%%"),
        description=text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run, command=name)
    return parser


def add_take(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("take", metavar="TAKE", type=Path, help="the folder of a take")


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write the results as JSON, units in the keys"
    )


def spread_settings(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `--set A=1 B=2` written as `--set A=1 --set B=2`."""
    out: list[str] = []
    after_set = False
    for argument in arguments:
        if after_set and out[-1] != "--set" and _ASSIGNMENT.fullmatch(argument):
            out.append("--set")
        elif after_set and out[-1] != "--set":
            after_set = False
        out.append(argument)
        after_set = after_set or argument == "--set"
    return out


def write_result(args: argparse.Namespace, value: Mapping[str, Any]) -> None:
    """Write a command's result to `--json FILE`, if given."""
    if args.json is not None:
        from studio.engine.base.files import write_json

        write_json(args.json, value)


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as lines of aligned columns: the first to the left, the others to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def figure(value: float | None, digits: int = 1) -> str:
    """Return a number for a table; - if not measured."""
    return "-" if value is None else f"{value:z.{digits}f}"


@contextmanager
def progress_bar(label: str) -> Iterator[Progress | None]:
    """Yield a function that draws the share done, or None if standard error is no terminal.

    The bar appears once the work has taken a second, and is removed at the end.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
    with tqdm(total=1.0, desc=label, bar_format=layout, delay=1.0, leave=False, file=sys.stderr) as bar:

        def draw(share: float) -> None:
            bar.update(share - bar.n)

        yield draw

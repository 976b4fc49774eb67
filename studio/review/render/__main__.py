"""`python -m studio.review.render POSES.npz [POSES.npz ...] OUT.png [--times 1,2,3]` draws a strip of frames."""

import argparse
import sys
from pathlib import Path

from studio.engine.base.errors import StudioError
from studio.engine.model.poses import Poses
from studio.review.render.strip import render_strip, stage_times


def numbers(text: str) -> list[float]:
    """Return the numbers in `1,2.5,3` (an argparse type)."""
    return [float(part) for part in text.split(",") if part.strip()]


def _names(paths: list[Path]) -> list[str]:
    """A name per file: its folder for a `poses.npz`, else its stem; duplicates are numbered."""
    names = [path.parent.name if path.stem == "poses" else path.stem for path in paths]
    return [f"{name} {i + 1}" if names.count(name) > 1 else name for i, name in enumerate(names)]


def main(argv: list[str] | None = None) -> int:
    """Draw the files named on the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m studio.review.render", description=__doc__)
    parser.add_argument("poses", nargs="+", type=Path, help="poses.npz files, one row each")
    parser.add_argument("out", type=Path, help="the PNG to write")
    parser.add_argument("--times", type=numbers, default=None, help="stage times [s], comma separated")
    parser.add_argument("--count", type=int, default=8, help="how many instants where --times is missing")
    parser.add_argument("--yaw", type=float, default=25.0, help="viewer: 0 = front, 90 = performer's left")
    arguments = parser.parse_args(argv)
    try:
        rows = {
            name: Poses.load(path)
            for name, path in zip(_names(arguments.poses), arguments.poses, strict=True)
        }
        first = next(iter(rows.values()))
        times_s = None if arguments.times is None else stage_times(first, arguments.times)
        one = first if len(rows) == 1 else rows
        render_strip(one, arguments.out, times_s=times_s, count=arguments.count, yaw_deg=arguments.yaw)
    except StudioError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

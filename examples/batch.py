"""Solves every take of a folder and exports it as BVH, one process a core.

python examples/batch.py TAKES OUT
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import studio


def solve_and_export(take_path: Path, out: Path) -> str:
    """Return one line that says what became of a take."""
    try:
        take = studio.open_take(take_path)
        if not take.calibration_numbers():
            studio.calibrate(take)
        poses = studio.solve(take, "studio")
        file = studio.export(poses, out / f"{take_path.name}.bvh", fps=30.0)
    except studio.StudioError as error:
        return f"{take_path.name}: {error}"
    return f"{take_path.name}: {poses.frame_count} frames, {file}"


def main(takes: Path, out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    paths = sorted(file.parent for file in takes.rglob("take.json"))
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for line in pool.map(solve_and_export, paths, [out] * len(paths)):
            print(line)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))

"""Time and accuracy of poses from pictures: `.venv/bin/python -m tests.engine.seeing.pictures.bars`.

Time: finding the pose in decoded pictures, including their reduction, as `PoseFinder.find` does. Reprojection: four
real cameras around a walking person, against the points that fit them best by their true poses. Exchanged: camera
frames in which left and right fit the other cameras clearly better after an exchange.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.poses import PoseFinder
from tests.engine.seeing.pictures.videos import pictures_of, reprojected, true_cameras

NAMES = JOINT_SETS["mediapipe"]
OTHER = [
    NAMES.index(name.replace("left", "*").replace("right", "left").replace("*", "right")) for name in NAMES
]
"""Each landmark's counterpart on the other side."""

_CLEARLY = 0.7
"""An exchange counts if it reduces the error to this share."""


def main() -> None:
    """Print a table row per model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", default=["lite", "full"], help="models or their files")
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    arguments = parser.parse_args()
    folder = arguments.data / "rgb" / "pose2sim_single"
    cameras = true_cameras(folder)
    pictures = {name: pictures_of(folder / f"{name}.mp4") for name in cameras}
    for model in arguments.models:
        spent_ms: list[float] = []
        pixels = []
        for of_camera in pictures.values():
            finder = PoseFinder(model)
            pixels.append([_found(finder, picture, spent_ms) for picture in of_camera])
        seen = np.array(pixels)  # cameras, frames, landmarks, 2
        errors = np.stack(
            [reprojected(seen[:, k], list(cameras.values())) for k in range(seen.shape[1])], axis=1
        )
        exchanged = sum(_exchanged(seen[:, k], list(cameras.values())) for k in range(seen.shape[1]))
        print(
            f"{Path(model).name}: {np.median(spent_ms):.0f} ms, 95 % {np.percentile(spent_ms, 95):.0f} ms; "
            f"{np.median(errors):.1f} px, 95 % {np.percentile(errors, 95):.0f} px; "
            f"{exchanged} of {seen.shape[0] * seen.shape[1]} camera frames exchanged"
        )


def _found(finder: PoseFinder, picture: NDArray[np.uint8], spent_ms: list[float]) -> NDArray[np.float64]:
    began = time.perf_counter()
    pose = finder.find(picture)
    spent_ms.append(1e3 * (time.perf_counter() - began))
    return np.full((len(NAMES), 2), np.nan) if pose is None else pose.pixels


def _exchanged(seen: NDArray[np.float64], cameras: list) -> int:
    """Number of cameras of one frame that fit better with left and right exchanged."""
    limbs = [
        k for k, name in enumerate(NAMES) if name.split("_")[-1] in ("knee", "ankle", "elbow", "wrist", "hip")
    ]
    ways = []
    for mask in range(1 << (len(cameras) - 1)):  # one of each way and its opposite
        turned = [k for k in range(len(cameras)) if mask >> k & 1]
        tried = seen.copy()
        tried[turned] = tried[turned][:, OTHER]
        ways.append((float(np.median(reprojected(tried[:, limbs], cameras))), len(turned)))
    error_px, count = min(ways)
    return min(count, len(cameras) - count) if error_px < _CLEARLY * ways[0][0] else 0


if __name__ == "__main__":
    main()

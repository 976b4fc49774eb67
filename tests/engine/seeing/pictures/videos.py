"""Pictures of real videos, and the cameras that recorded them."""

import json
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.lens import Lens


def pictures_of(video: Path, *, every: int = 1, count: int = 1_000_000) -> list[NDArray[np.uint8]]:
    """Every n-th picture of a video, RGB."""
    found = []
    with av.open(str(video)) as container:
        for number, frame in enumerate(container.decode(video=0)):
            if number % every == 0:
                found.append(frame.to_ndarray(format="rgb24"))
            if len(found) == count:
                break
    return found


def true_cameras(folder: Path) -> dict[str, tuple[Lens, NDArray[np.float64]]]:
    """The cameras of a folder of videos by name: lens, and the transform from the world, shape (3, 4)."""
    cameras = {}
    for name, one in json.loads((folder / "truth" / "cameras.json").read_text(encoding="utf-8")).items():
        (fx, _, cx), (_, fy, cy), _ = one["K"]
        lens = Lens(fx, fy, cx, cy, 1080, 1920, tuple(one["distortion"]))
        cameras[name] = lens, np.column_stack([one["R_camera_world"], one["t_camera_world_m"]])
    return cameras


def reprojected(
    pixels: NDArray[np.float64], cameras: list[tuple[Lens, NDArray[np.float64]]]
) -> NDArray[np.float64]:
    """How far points are from their best common place in each camera [pixels], shape (cameras, points).

    Args:
        pixels: of the points in each camera, shape (cameras, points, 2).
        cameras: as `true_cameras`.
    """
    rays = [lens.rays_of(seen) for (lens, _), seen in zip(cameras, pixels, strict=True)]
    weights = np.ones(pixels.shape[:2])
    errors = weights
    for _ in range(10):
        rows = [
            weight[:, None, None] * (ray[..., None] * T[2] - T[:2])
            for weight, ray, (_, T) in zip(weights, rays, cameras, strict=True)
        ]
        places = np.linalg.svd(np.concatenate(rows, axis=1))[2][:, -1]
        places = places[:, :3] / places[:, 3:]
        seen = [lens.pixels_of(places @ T[:, :3].T + T[:, 3]) for lens, T in cameras]
        errors = np.linalg.norm(np.array(seen) - pixels, axis=-1)
        weights = 1.0 / np.sqrt(1.0 + (errors / 10.0) ** 2)
    return errors

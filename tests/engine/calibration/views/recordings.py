"""Recordings of ordinary cameras in the outside data, as views, and how far found cameras are from the truth."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.engine.base.geometry import fit_rigid, invert_transform, make_transform, transform_points
from studio.engine.calibration.views.judging.result import ViewsResult
from studio.engine.calibration.views.seen.view import View
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.joints import to_canonical

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """True cameras: lens and T_camera_world by name, and how far its pictures are ahead of its stamps [s]."""

    lenses: dict[str, Lens]
    T_camera_world: dict[str, Array]
    ahead_s: dict[str, float]


@dataclass(frozen=True)
class Error:
    """Worst errors of cameras relative to the first, after the best scale: degrees, metres, seconds; and the mean
    error of joints that they triangulate from exact pixels [m]."""

    turn_deg: float
    place_m: float
    ahead_s: float
    joints_m: float


def folder_of(test_data: Path, name: str) -> Path:
    folder = test_data / "rgb" / name
    if not folder.is_dir():
        pytest.skip(f"no recordings of ordinary cameras at {folder}; set STUDIO_TEST_DATA")
    return folder


def views_of(
    time_s: Array, pixels: Array, visibility: Array, world_m: Array, names: Sequence[str], size: Sequence[int]
) -> list[View]:
    """Return views of BlazePose's 33 landmarks: pixels and world landmarks by camera, frame and landmark."""
    out = []
    for c, name in enumerate(names):
        padded = np.concatenate([pixels[c], np.zeros((*pixels[c].shape[:2], 1))], axis=2)
        places = [to_canonical("mediapipe", p, v) for p, v in zip(padded, visibility[c], strict=True)]
        world = [to_canonical("mediapipe", p, v)[0] for p, v in zip(world_m[c], visibility[c], strict=True)]
        out.append(
            View(
                name,
                np.asarray(time_s, dtype=np.float64),
                np.stack([p[0][:, :2] for p in places]),
                np.stack([p[1] for p in places]),
                np.stack(world),
                int(size[0]),
                int(size[1]),
            )
        )
    return out


def walk(test_data: Path, name: str, every: int = 1) -> list[View]:
    """Return the views of a recorded walk, with every n-th frame only."""
    folder = folder_of(test_data, name)
    names = [*json.loads((folder / "truth" / "cameras.json").read_text())]
    with np.load(folder / "landmarks.npz") as data:
        return views_of(
            data["time_s"][::every],
            data["pixels"][:, ::every].astype(np.float64),
            data["visibility"][:, ::every].astype(np.float64),
            data["world_m"][:, ::every].astype(np.float64),
            names,
            data["image_size"],
        )


def truth_of(test_data: Path, name: str, size: Sequence[int] = (1088, 1920)) -> Truth:
    cameras = json.loads((folder_of(test_data, name) / "truth" / "cameras.json").read_text())
    lenses, places, ahead = {}, {}, {}
    for camera, value in cameras.items():
        (fx, _, cx), (_, fy, cy), _ = value["K"]
        lenses[camera] = Lens(fx, fy, cx, cy, size[0], size[1], tuple(value.get("distortion", ())))
        places[camera] = make_transform(
            np.array(value["R_camera_world"]), np.array(value["t_camera_world_m"])
        )
        ahead[camera] = float(value.get("clock_ahead_s", 0.0))
    return Truth(lenses, places, ahead)


def landmarks_m(test_data: Path, name: str) -> Array:
    """Return true landmarks [m], shape (frame_count, 33, 3)."""
    with np.load(folder_of(test_data, name) / "truth" / "landmarks_m.npz") as data:
        return data["positions"].astype(np.float64)


def error_of(result: ViewsResult, truth: Truth, landmarks: Array) -> Error:
    """Return how far cameras are from the truth; landmarks: true points that all cameras see [m], shape (..., 3)."""
    names = [*result.cameras]
    first, true_first = result.cameras[names[0]].T_stage_camera, truth.T_camera_world[names[0]]
    found = [invert_transform(first) @ result.cameras[n].T_stage_camera for n in names]
    true = [true_first @ invert_transform(truth.T_camera_world[n]) for n in names]
    places, true_places = np.array([T[:3, 3] for T in found]), np.array([T[:3, 3] for T in true])
    scale = float((places * true_places).sum() / (places**2).sum())
    turns = [np.trace(a[:3, :3].T @ b[:3, :3]) for a, b in zip(found, true, strict=True)]
    ahead = [
        result.cameras[n].ahead_s
        - result.cameras[names[0]].ahead_s
        - truth.ahead_s[n]
        + truth.ahead_s[names[0]]
        for n in names
    ]
    return Error(
        float(np.degrees(np.arccos(np.clip((np.array(turns) - 1) / 2, -1, 1))).max()),
        float(np.linalg.norm(scale * places - true_places, axis=1).max()),
        float(np.abs(ahead).max()),
        _induced(result, truth, landmarks.reshape(-1, 3)),
    )


def _induced(result: ViewsResult, truth: Truth, points: Array) -> float:
    """Return the mean error of points triangulated by found cameras from exact pixels, after the best similarity."""
    A, b = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    for name, camera in result.cameras.items():
        pixels = truth.lenses[name].pixels_of(transform_points(truth.T_camera_world[name], points))
        ways = np.concatenate([camera.lens.rays_of(pixels), np.ones((len(points), 1))], axis=1)
        ways = ways / np.linalg.norm(ways, axis=1, keepdims=True) @ camera.T_stage_camera[:3, :3].T
        across = np.eye(3) - ways[:, :, None] * ways[:, None, :]
        A += across
        b += across @ camera.T_stage_camera[:3, 3]
    found: Array = np.asarray(np.linalg.solve(A, b[..., None])[..., 0], dtype=np.float64)
    T = fit_rigid(found, points)
    turned = (found - found.mean(axis=0)) @ T[:3, :3].T
    centred = points - points.mean(axis=0)
    scale = float((turned * centred).sum() / (turned**2).sum())
    return float(np.linalg.norm(scale * turned - centred, axis=1).mean())

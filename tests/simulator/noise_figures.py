"""Figures of a tracker's errors, for recordings and the simulator alike, from tracked and true joints."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from studio.engine.model.joints import CANONICAL, INDEX, MIRROR

FAMILY = {"elbow": 1, "knee": 1, "wrist": 2, "ankle": 2, "hand": 3, "toe": 3}
_FAMILIES = np.array([FAMILY.get(name.split("_")[-1], 0) for name in CANONICAL])
_LEFT = [i for i, name in enumerate(CANONICAL) if name.startswith("left")]


@dataclass(frozen=True)
class Watched:
    """One camera's frames, with the truth at their instants (stage frame)."""

    T_stage_camera: np.ndarray
    positions: np.ndarray
    confidence: np.ndarray
    truth: np.ndarray
    rest: np.ndarray


def read_watched(folder: Path, camera: str) -> Watched:
    """Return a camera of a `noisy_joints` recording."""
    truth_s, truth, _ = _read(folder / "truth" / "joints.csv", confidence=False)
    device_s, positions, confidence = _read(folder / camera / "joints.csv", confidence=True)
    told = json.loads((folder / "truth" / "cameras.json").read_text())["cameras"][camera]
    time_s = (device_s - told["clock_offset_s"]) / (1 + told["clock_drift"])
    at = CubicSpline(truth_s, truth)(np.clip(time_s, truth_s[0], truth_s[-1]))
    return Watched(np.array(told["T_stage_camera"]), positions, confidence, at, truth[0])


def _read(path: Path, *, confidence: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    column = {name: i for i, name in enumerate(header)}
    positions = np.stack([table[:, [column[f"{j}_{a}"] for a in "xyz"]] for j in CANONICAL], axis=1)
    surety = table[:, [column[f"{j}_confidence"] for j in CANONICAL]] if confidence else np.ones(len(rows))
    return table[:, column["time_s"]], positions, surety


def figures(watched: Watched) -> dict[str, float]:
    """Return shares, runs and standard deviations; along-ray SD in units of 0.0016 z^2 m."""
    T = watched.T_stage_camera
    true = (watched.truth - T[:3, 3]) @ T[:3, :3]
    reach = np.linalg.norm(true, axis=-1)
    ray = true / reach[..., None]
    error = watched.positions - true
    along = (error * ray).sum(axis=-1)
    across = error - along[..., None] * ray
    size = np.linalg.norm(error, axis=-1)
    seen = np.isfinite(along)
    hidden, outlier = seen & (watched.confidence < 0.6), seen & (watched.confidence == 1)
    swapped = _swapped(watched.positions, true)
    behind = _behind(watched.truth, T[:3, 3])
    sound = seen & ~outlier & ~swapped[:, None]
    out = {
        "dropped": 1 - seen.mean(),
        "hidden": hidden.sum() / seen.sum(),
        "outliers": outlier.mean(),
        "outlier_m": np.median(size[outlier & ~swapped[:, None]]),
        "towards_m": -np.mean(along[sound & ~hidden]),
        "swapped_behind": swapped[behind].mean() if behind.any() else 0.0,
        "swapped_front": swapped[~behind].mean(),
        "drop_run": _run_length(~seen),
        "outlier_run": _run_length(outlier),
        "least_sure": watched.confidence[sound & ~hidden].min(),
        "surest_hidden": watched.confidence[hidden].max(),
    }
    for family in range(4):
        joints = family == _FAMILIES
        for name, part in (("", sound & ~hidden), ("_hidden", sound & hidden & (size < 1))):
            out[f"along_{family}{name}"] = _sd(along / (0.0016 * reach**2), part, joints)
            out[f"across_{family}{name}"] = _sd(across, part, joints) / np.sqrt(2)
    return {key: float(value) for key, value in out.items()}


def _sd(values: np.ndarray, part: np.ndarray, joints: np.ndarray) -> float:
    """SD of AR(1) noise of coefficient 0.8, from its differences, which constant offsets do not affect."""
    pairs = part[1:] & part[:-1] & joints
    steps = np.diff(values, axis=0)[pairs]
    return float(np.sqrt((steps.reshape(len(steps), -1) ** 2).sum(axis=1).mean() / (2 * (1 - 0.8))))


def _swapped(positions: np.ndarray, true: np.ndarray) -> np.ndarray:
    straight = np.linalg.norm(positions - true, axis=-1)[:, _LEFT]
    crossed = np.linalg.norm(positions[:, MIRROR] - true, axis=-1)[:, _LEFT]
    return np.nanmedian(crossed, axis=1) < np.nanmedian(straight, axis=1)


def _behind(joints: np.ndarray, eye: np.ndarray) -> np.ndarray:
    left = joints[:, INDEX["left_shoulder"]] - joints[:, INDEX["right_shoulder"]]
    facing = np.cross(left, [0.0, 0.0, 1.0])
    return (facing * (eye - joints[:, 0])).sum(axis=-1) < 0


def _run_length(mask: np.ndarray) -> float:
    """Mean length of runs of True down the columns."""
    edges = np.diff(np.pad(mask.astype(int), ((1, 1), (0, 0))), axis=0)
    return mask.sum() / max((edges == 1).sum(), 1)

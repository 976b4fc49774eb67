"""A walking performer seen by noisy cameras, with known truth: the noise of `noisy-joints` in plain NumPy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from studio.engine.base.geometry import invert_transform, make_transform, transform_points
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR, PARENTS

OFFSETS_M = {
    "hips": (0, 0, 0.97),
    "spine": (0, 0.01, 0.12),
    "chest": (0, 0.01, 0.22),
    "neck": (0, 0, 0.13),
    "head": (0, -0.02, 0.17),
    "left_shoulder": (0.18, 0, 0.08),
    "left_elbow": (0.29, 0, 0),
    "left_wrist": (0.25, 0, 0),
    "left_hand": (0.09, 0, 0),
    "left_hip": (0.10, 0, -0.03),
    "left_knee": (0, 0, -0.43),
    "left_ankle": (0, 0, -0.425),
    "left_toe": (0, -0.13, -0.043),
}
"""T-pose offsets from the parent on the stage; the right side mirrors the left."""

T_POSE_S = 3.0


@dataclass(frozen=True)
class Options:
    """Errors of the cameras; the defaults are the noise contract."""

    noise: float = 1.0
    bias_m: float = 0.03
    spikes: bool = True
    dropouts: bool = True
    swaps: bool = True
    hidden: bool = True
    max_offset_s: float = 0.15
    max_drift: float = 1e-4
    jitter_s: float = 0.003
    duration_s: float = 34.0


@dataclass(frozen=True)
class Truth:
    """Camera poses and clocks: device time = stage time * (1 + drift) + offset."""

    T_stage_camera: dict[str, NDArray[np.float64]]
    offset_s: dict[str, float]
    drift: dict[str, float]


def look_at(azimuth_deg: float, height_m: float, distance_m: float = 3.5) -> NDArray[np.float64]:
    """Return T_stage_camera of a camera that looks at the stage's middle; azimuth 0 is in front of the T-pose."""
    a = np.radians(azimuth_deg)
    place = np.array([distance_m * np.sin(a), -distance_m * np.cos(a), height_m])
    forward = np.array([0.0, 0.0, 1.0]) - place
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return make_transform(np.column_stack([right, np.cross(forward, right), forward]), place)


RIGS = {
    1: [look_at(0, 1.0)],
    2: [look_at(-35, 1.0), look_at(35, 1.6)],
    3: [look_at(0, 1.0), look_at(60, 1.6), look_at(-60, 1.0)],
    4: [look_at(0, 1.0), look_at(90, 1.6), look_at(180, 1.0), look_at(270, 1.6)],
}


def offsets() -> NDArray[np.float64]:
    """Return the performer's T-pose offsets [m], shape (21, 3)."""
    out = np.zeros((len(CANONICAL), 3))
    for name, offset in OFFSETS_M.items():
        out[INDEX[name]] = offset
        if name.startswith("left_"):
            out[MIRROR[INDEX[name]]] = np.array(offset) * [-1, 1, 1]
    return out


def performer(times_s: NDArray[np.float64], *, walking: bool = True) -> NDArray[np.float64]:
    """Return the true joints at stage times [m], shape (instant_count, 21, 3): a T-pose, then a walk all around."""
    t = np.maximum(times_s - T_POSE_S, 0.0)
    go = np.clip(t / 1.0, 0.0, 1.0) * (1.0 if walking else 0.0)
    place = (
        1.1
        * go[:, None]
        * np.column_stack([np.sin(0.45 * t), 0.8 * np.sin(0.9 * t + 0.3) - 0.3 * np.sin(0.3)])
    )
    heading = go * (1.4 * np.sin(0.5 * t) + 0.45 * t)
    stride = go * np.sin(2 * np.pi * 0.95 * t)
    arms_down = np.clip(t / 1.0, 0.0, 1.0) * 1.35
    turn = _about(2, heading)
    rotations: dict[str, NDArray[np.float64]] = {}
    joints = np.zeros((len(t), len(CANONICAL), 3))
    own = {
        f"{side}_{name}": None for side in ("left", "right") for name in ("shoulder", "elbow", "hip", "knee")
    }
    for side, sign in (("left", 1.0), ("right", -1.0)):
        swing = sign * stride
        own[f"{side}_shoulder"] = _about(0, 0.5 * swing) @ _about(1, sign * arms_down)
        own[f"{side}_elbow"] = _about(2, -sign * 0.3 * go * (1 - 0.5 * swing))
        own[f"{side}_hip"] = _about(0, -0.45 * swing)
        own[f"{side}_knee"] = _about(0, 0.45 * go * np.maximum(0, -np.cos(2 * np.pi * 0.95 * t) * sign))
    lean = _about(0, np.full(len(t), 0.03))
    for j, name in enumerate(CANONICAL):
        offset = offsets()[j]
        if name == "hips":
            rotations[name] = turn
            joints[:, j] = np.column_stack([place, offset[2] - 0.06 * np.abs(stride)])
            continue
        parent = CANONICAL[PARENTS[j]]
        joints[:, j] = joints[:, PARENTS[j]] + rotations[parent] @ offset
        rotations[name] = rotations[parent] @ (own.get(name) if own.get(name) is not None else np.eye(3))
        if name == "spine":
            rotations[name] = turn @ lean
    lowest = joints[:, [INDEX["left_toe"], INDEX["right_toe"]], 2].min(axis=1)
    joints[:, :, 2] += (0.04 - lowest)[:, None]
    return joints


def _about(axis: int, angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotations about a stage axis, shape (count, 3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[:, axis, axis] = 1
    out[:, i, i], out[:, j, j] = c, c
    out[:, i, j], out[:, j, i] = -s, s
    return out


def record(
    seed: int, rig: list[NDArray[np.float64]], options: Options | None = None, *, walking: bool = True
) -> tuple[dict[str, list[CameraFrame]], Truth]:
    """Return the cameras' frames of one performance, and the truth; camera_0's clock is the stage's."""
    options = options or Options()
    rng = np.random.default_rng(seed)
    frames, truth = {}, Truth({}, {}, {})
    for k, T in enumerate(rig):
        name = f"camera_{k}"
        truth.T_stage_camera[name] = T
        truth.offset_s[name] = 0.0 if k == 0 else rng.uniform(-options.max_offset_s, options.max_offset_s)
        truth.drift[name] = 0.0 if k == 0 else rng.uniform(-options.max_drift, options.max_drift)
        stage_s = np.arange(0.2 + rng.uniform(0, 1 / 30), options.duration_s, 1 / 30)
        stage_s += np.clip(rng.normal(0, options.jitter_s, len(stage_s)), -0.012, 0.012)
        local, confidence = _observe(rng, performer(stage_s, walking=walking), T, options)
        device_s = stage_s * (1 + truth.drift[name]) + truth.offset_s[name] + 100.0
        frames[name] = [
            CameraFrame(name, i, round(device_s[i] * 1e9), local[i], confidence[i])
            for i in range(len(stage_s))
        ]
    return frames, truth


def _observe(
    rng: np.random.Generator, joints: NDArray[np.float64], T: NDArray[np.float64], options: Options
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what a camera reports of the true joints: camera frame [m], and confidence."""
    p = transform_points(invert_transform(T), joints)
    count, joint_count = p.shape[:2]
    ray = p / np.linalg.norm(p, axis=2, keepdims=True)
    kinds = {"elbow": 1.0, "knee": 1.0, "wrist": 1.5, "ankle": 1.5, "hand": 2.0, "toe": 2.0}
    factor = np.array([kinds.get(name.split("_")[-1], 0.7) for name in CANONICAL])
    hidden = options.hidden & (gaussian_filter1d(rng.normal(size=(count, joint_count)), 8, axis=0) > 0.16)
    factor = factor * np.where(hidden, 4.0, 1.0)
    white = rng.normal(size=(2, count, joint_count, 3)) * np.sqrt(1 - 0.8**2)
    along, across = lfilter([1.0], [1.0, -0.8], white, axis=1)
    along = ray * along[..., :1] * 0.0016 * p[..., 2:] ** 2
    across = 0.01 * (across - ray * (across * ray).sum(axis=2, keepdims=True))
    out = p - options.bias_m * ray + options.noise * factor[..., None] * (along + across)
    confidence = np.where(hidden, rng.uniform(0.2, 0.5, hidden.shape), rng.uniform(0.85, 1.0, hidden.shape))
    if options.spikes:
        for first, j in _bursts(rng, count, joint_count, 0.01 / 5.5):
            n = rng.integers(1, 11)
            way = rng.normal(size=3)
            out[first : first + n, j] += way / np.linalg.norm(way) * rng.uniform(0.2, 0.5)
            confidence[first : first + n, j] = 1.0
    if options.dropouts:
        for first, j in _bursts(rng, count, joint_count, 0.03 / 7):
            n = rng.integers(2, 13)
            out[first : first + n, j] = np.nan
            confidence[first : first + n, j] = 0.0
    if options.swaps:
        across_body = joints[:, INDEX["left_shoulder"]] - joints[:, INDEX["right_shoulder"]]
        facing = np.cross(across_body, [0.0, 0.0, 1.0])
        behind = (facing * (T[:3, 3] - joints[:, 0])).sum(axis=1) < 0
        swapped = behind & (np.repeat(rng.random(count // 20 + 1), 20)[:count] < 0.5)
        out[swapped], confidence[swapped] = out[swapped][:, MIRROR], confidence[swapped][:, MIRROR]
    return out, confidence


def _bursts(rng: np.random.Generator, count: int, joint_count: int, rate: float) -> NDArray[np.int64]:
    return np.argwhere(rng.random((count, joint_count)) < rate)

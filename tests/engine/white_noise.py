"""Joints with white noise, spikes and drop-outs from one camera at a known place, and the errors of their solve.

No device has this noise: it shows how well a solve handles joints with independent errors.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.calibration.calibrate import with_performer
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.simulator.motion import stage_motion
from studio.simulator.rig import standard_rig

MOTIONS = ("02_05", "14_08", "05_06", "49_02")
TUNED_ON = ("02_05", "05_06")
"""The only two motions on which settings were chosen."""

UNIT_M = 0.056444
"""The unit of these BVH files [m]."""

RATE_HZ = 30
SIGMA_M = 0.02
SPIKE_SHARE, SPIKE_M = 0.05, 0.30
DROPPED_SHARE, DROP_FRAMES = 0.10, (2, 12)
SETTLED_FRAMES = 30


@dataclass(frozen=True)
class Figures:
    """How far a solve's canonical joints are from the truth."""

    rms_cm: float
    acceleration_error_m_s2: float


def _spikes(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.float64]:
    """Shifts in random directions [m], shape (F, 21, 3); most are 0."""
    direction = rng.normal(size=(*shape, 3))
    direction *= SPIKE_M / np.linalg.norm(direction, axis=2, keepdims=True)
    return direction * (rng.random(shape) < SPIKE_SHARE)[..., None]


def _dropped(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Which joints are missing in which frames, in bursts, shape (F, 21)."""
    low, high = DROP_FRAMES
    starts = DROPPED_SHARE / (0.5 * (low + high)) / (1.0 - DROPPED_SHARE)
    dropped = np.zeros(shape, dtype=bool)
    for joint in range(shape[1]):
        frame = 0
        while frame < shape[0]:
            if rng.random() < starts:
                length = int(rng.integers(low, high + 1))
                dropped[frame : frame + length, joint] = True
                frame += length
            else:
                frame += 1
    return dropped


def noisy_take(
    bvh: Path, *, seed: int = 1, seconds: float = 15.0, noise: bool = True
) -> tuple[list[CameraFrame], Calibration, CanonicalMotion]:
    """Return the frames of the one camera, its true calibration with the truth's proportions, and the truth.

    The height of the feet over the floor is measured in the frames, as in a solve. Without `noise` the joints are the
    true ones, and none is missing.
    """
    motion, _ = stage_motion(bvh, unit_m=UNIT_M, calibration=False)
    T_stage_camera = standard_rig(1)[0].T_stage_camera
    rng = np.random.default_rng(seed)
    count = int(min(motion.duration_s, seconds) * RATE_HZ)
    joints = np.stack([motion.at(k / RATE_HZ) for k in range(count)])
    noisy = joints + rng.normal(0.0, SIGMA_M, joints.shape) + _spikes(joints.shape[:2], rng)
    dropped = _dropped(joints.shape[:2], rng)
    if not noise:
        noisy, dropped = joints.copy(), np.zeros_like(dropped)
    noisy[dropped] = np.nan
    in_camera = transform_points(invert_transform(T_stage_camera), noisy)
    confidence = np.where(dropped, 0.0, 0.95)
    frames = [
        CameraFrame("camera_0", k, k * 1_000_000_000 // RATE_HZ, in_camera[k], confidence[k])
        for k in range(count)
    ]
    performer = Performer(1.75, motion.offsets_m)
    calibration = Calibration("camera_0", {"camera_0": CameraCalibration(T_stage_camera)}, performer)
    return frames, with_performer(calibration, {"camera_0": frames}), motion


def figures(poses: Poses, truth: CanonicalMotion) -> Figures:
    """Return the figures without the first second; accelerations are differences over 1/30 s."""
    true = np.stack([truth.at(t) for t in poses.time_s])
    solved = poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX]
    stride = max(1, round(1.0 / (RATE_HZ * float(np.median(np.diff(poses.time_s))))))
    settled = slice(SETTLED_FRAMES, None)

    def acceleration(joints: NDArray[np.float64]) -> NDArray[np.float64]:
        joints = joints[settled]
        return (joints[2 * stride :] - 2.0 * joints[stride:-stride] + joints[: -2 * stride]) * RATE_HZ**2

    error = np.linalg.norm(solved - true, axis=2)[settled]
    off = np.linalg.norm(acceleration(solved) - acceleration(true), axis=2)
    return Figures(float(100.0 * np.sqrt((error**2).mean())), float(off.mean()))


def solved_figures(bvh: Path, preset: str, *assignments: str, seconds: float = 15.0) -> Figures:
    """Return the figures of a motion under a preset's settings."""
    frames, calibration, truth = noisy_take(bvh, seconds=seconds)
    return figures(solve_frames(frames, calibration, parse_settings(preset, assignments)), truth)

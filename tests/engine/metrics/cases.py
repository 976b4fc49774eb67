"""Motions with known answers for the tests of the metrics."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.joints import (
    INDEX,
    JOINT_COUNT,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    OUTPUT_PARENTS,
)
from studio.engine.model.poses import Poses


def poses_of(time_s: NDArray[np.float64], canonical_m: NDArray[np.float64]) -> Poses:
    """Poses whose canonical joints are at these places, shape (frame_count, 21, 3), all seen."""
    frames, joints = len(time_s), len(OUTPUT_JOINTS)
    positions = np.zeros((frames, joints, 3))
    positions[:, OUTPUT_OF_CANONICAL_INDEX] = canonical_m
    return Poses(
        time_s=time_s,
        joint_names=OUTPUT_JOINTS,
        parents=OUTPUT_PARENTS,
        positions_m=positions,
        rotations_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (frames, joints, 1)),
        confidence=np.ones((frames, joints)),
        uncertainty_mm=np.full((frames, joints), np.nan),
    )


def still(frames: int, seed: int = 0) -> NDArray[np.float64]:
    """A body that does not move: 21 fixed points in the stage frame [m], shape (frames, 21, 3)."""
    body = np.random.default_rng(seed).uniform(-1.0, 1.0, (JOINT_COUNT, 3)) + np.array([0.0, 0.0, 1.0])
    return np.repeat(body[None], frames, axis=0)


def dance(time_s: NDArray[np.float64], seed: int = 0) -> NDArray[np.float64]:
    """A smooth motion of all joints, defined at every time, shape (len(time_s), 21, 3) [m]."""
    rng = np.random.default_rng(seed)
    out = still(len(time_s), seed)
    for _ in range(6):
        frequency, phase = rng.uniform(0.15, 1.2), rng.uniform(0, 2 * np.pi, (JOINT_COUNT, 3))
        amplitude = rng.uniform(0.02, 0.12, (JOINT_COUNT, 3))
        out = out + amplitude * np.sin(2 * np.pi * frequency * time_s[:, None, None] + phase)
    return out


def reference_of(time_s: NDArray[np.float64], canonical_m: NDArray[np.float64]) -> Reference:
    return Reference(time_s, canonical_m)


def shifted(canonical_m: NDArray[np.float64], shifts: dict[str, list[float]]) -> NDArray[np.float64]:
    """The motion with some joints moved by constant vectors [m]."""
    out = canonical_m.copy()
    for name, vector in shifts.items():
        out[:, INDEX[name]] += vector
    return out

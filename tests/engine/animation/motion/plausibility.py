"""Figures over all frames that show whether a canonical motion is humanly possible."""

import numpy as np

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS


def figures(motion: CanonicalMotion) -> dict[str, float]:
    """Return slide of standing toes, lowest foot joint, change of bone lengths, speeds and knees."""
    positions, rate = motion.positions_m, 1 / motion.frame_s
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=-1) * rate
    toes = [INDEX["left_toe"], INDEX["right_toe"]]
    feet = [*toes, INDEX["left_ankle"], INDEX["right_ankle"]]
    standing = positions[:-1, toes, 2] < 0.0252
    bones = np.stack(
        [
            np.linalg.norm(positions[:, i] - positions[:, PARENTS[i]], axis=-1)
            for i in range(1, len(CANONICAL))
        ],
        axis=1,
    )
    return {
        "slide_m_s": float(np.percentile(speed[:, toes][standing], 99)),
        "lowest_m": float(positions[:, feet, 2].min()),
        "bone_change_m": float(np.ptp(bones, axis=0).max()),
        "bone_error_m": float(np.abs(bones - np.linalg.norm(motion.offsets_m[1:], axis=-1)).max()),
        "fastest_m_s": float(speed.max()),
        "largest_acceleration_m_s2": float(
            np.linalg.norm(np.diff(positions, n=2, axis=0), axis=-1).max() * rate**2
        ),
        "knee_forward_m": min(_knee_forward(positions, side) for side in ("left", "right")),
        "straightest_knee_deg": float(max(_knee_angle(positions, side).max() for side in ("left", "right"))),
    }


def _knee_forward(positions: np.ndarray, side: str) -> float:
    """Least distance of a knee in front of the middle between hip and ankle, along the body's forward direction."""
    hip, knee, ankle = (positions[:, INDEX[f"{side}_{j}"]] for j in ("hip", "knee", "ankle"))
    lateral = positions[:, INDEX["left_hip"]] - positions[:, INDEX["right_hip"]]
    forward = np.cross(lateral, [0.0, 0.0, 1.0])
    forward /= np.linalg.norm(forward, axis=-1, keepdims=True)
    middle = hip + (ankle - hip) * 0.5
    return float(((knee - middle) * forward).sum(axis=-1).min())


def _knee_angle(positions: np.ndarray, side: str) -> np.ndarray:
    hip, knee, ankle = (positions[:, INDEX[f"{side}_{j}"]] for j in ("hip", "knee", "ankle"))
    a, b = hip - knee, ankle - knee
    cosine = (a * b).sum(-1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))

"""Sliding of standing feet, in the stances of a reference; for `metrics.own` the solve itself is the reference.

A foot stands if the reference's ankle or toe is less than 5 cm above that joint's own standing
height and slower than 10 cm/s. The standing height is the joint's 5th percentile of height over the compared
frames, so that neither a wrong floor of the reference nor the ankle's own height (about 8 cm) matters.
Source: thresholds on height and speed of ankle and toe as in Rempe et al., "HuMoR", ICCV 2021, section 5.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.matching import Matched

STANCE_HEIGHT_M = 0.05
STANCE_SPEED_M_S = 0.10
FOOT_JOINTS = ("left_ankle", "left_toe", "right_ankle", "right_toe")


def foot_slides_cm_s(matched: Matched) -> tuple[float | None, float | None]:
    """Return the mean horizontal speed [cm/s] of standing ankles and toes: the solve's and the reference's.

    None where no foot stands or the reference has no feet. The solve is aligned, so that z is up in both.
    """
    names = [name for name in FOOT_JOINTS if matched.has(name)]
    if not names or len(matched.time_s) < 3:
        return None, None
    solve, reference = matched.pick(names)
    stance = stance_of(reference, matched.time_s)
    out = []
    for positions in (solve, reference):
        speed = np.linalg.norm(_velocity(positions, matched.time_s)[..., :2], axis=2)
        sliding = speed[stance[1:-1] & np.isfinite(speed)]
        out.append(float(sliding.mean() * 100) if len(sliding) else None)
    return out[0], out[1]


def stance_of(reference_m: NDArray[np.float64], time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether each foot joint stands, shape (frame_count, joint_count); in the first and last frame none does.

    Args:
        reference_m: foot joints of the reference, z up [m], shape (frame_count, joint_count, 3).
        time_s: shape (frame_count,).
    """
    height = reference_m[..., 2] - np.nanpercentile(reference_m[..., 2], 5, axis=0)
    slow = np.linalg.norm(_velocity(reference_m, time_s), axis=2) < STANCE_SPEED_M_S
    stance = np.zeros(height.shape, dtype=bool)
    stance[1:-1] = (height[1:-1] < STANCE_HEIGHT_M) & slow
    return stance


def _velocity(positions_m: NDArray[np.float64], time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Central differences [m/s], shape (frame_count - 2, joint_count, 3)."""
    return (positions_m[2:] - positions_m[:-2]) / (time_s[2:] - time_s[:-2])[:, None, None]

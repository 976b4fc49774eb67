"""Detects streams that show mirrored bodies: their toes point backwards, by their own left and right."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.merge import Walk
from studio.engine.model.joints import INDEX

_MIN_FEET = 200
_MIRRORED_SHARE = 0.58
"""Threshold. Left and right are swapped at most half of the time seen from behind, and never seen from the front."""


def mirrored_bodies(walk: Walk, up: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which cameras show mirrored bodies, shape (camera_count,); False where too few toes were seen.

    A mirrored stream whose left and right are also swapped shows a possible body, so it cannot be detected alone;
    `rigid.mirrored` compares it with the other cameras.

    Args:
        walk: the calibration part in any one frame.
        up: unit vector in that frame, shape (3,).
    """
    return np.array([_mirrored(mine, up) for mine in (walk.sure(i) for i in range(len(walk.positions)))])


def _mirrored(joints: NDArray[np.float64], up: NDArray[np.float64]) -> bool:
    """Whether the toes of joints, shape (instant_count, 21, 3), mostly point backwards."""
    lines = [
        joints[:, INDEX[f"left_{name}"]] - joints[:, INDEX[f"right_{name}"]] for name in ("shoulder", "hip")
    ]
    across = np.where(np.isfinite(lines), lines, 0.0).sum(axis=0)
    forward = np.cross(across, up)
    feet = [joints[:, INDEX[f"{side}_toe"]] - joints[:, INDEX[f"{side}_ankle"]] for side in ("left", "right")]
    ahead = np.concatenate([(foot * forward).sum(axis=1) for foot in feet])
    ahead = ahead[np.isfinite(ahead) & (ahead != 0.0)]
    return len(ahead) >= _MIN_FEET and float((ahead < 0.0).mean()) > _MIRRORED_SHARE

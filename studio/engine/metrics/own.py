"""Figures of a solve alone, without a reference: how calm it is, whether its feet stand, whether its bones keep."""

from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from studio.engine.metrics.bones import bone_length_sd_mm
from studio.engine.metrics.canonical import canonical_positions
from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.metrics.feet import foot_slides_cm_s
from studio.engine.metrics.matching import Matched, match
from studio.engine.metrics.reference import Reference
from studio.engine.metrics.smoothness import jerk_m_s3
from studio.engine.poses import Poses

JITTER_HZ = 6.0
"""Joints of a moving human stay below this; Winter, "Biomechanics and Motor Control of Human Movement", 2009,
section 3.4.4."""


def own_figures(poses: Poses, *, start_s: float | None = None) -> dict[str, Any]:
    """Return the figures of a solve by itself, with units in the keys; None = cannot be measured here.

    Feet stand where the solve's own are low and slow, so that the slide of a foot that never rests is not seen.

    Args:
        poses: the solve.
        start_s: stage time before which nothing counts (a take's calibration part).

    Raises:
        FormatError: fewer than 4 frames, or fewer than 3 measured joints.
    """
    itself = Reference(poses.time_s, canonical_positions(poses))
    matched = match(poses, itself, start_s=start_s)
    return {
        "jitter_mm": jitter_mm(matched),
        "jerk_m_s3": jerk_m_s3(matched),
        "foot_slide_cm_s": foot_slides_cm_s(matched)[0],
        "bone_length_sd_mm": bone_length_sd_mm(matched),
        "unseen_share": float(1.0 - matched.seen[:, matched.columns(matched.joints)].mean()),
        **solve_cleanup(poses, None, start_s=start_s),
        "frames": len(matched.time_s),
    }


def jitter_mm(matched: Matched) -> float | None:
    """Root mean square of what a joint moves above 6 Hz, as the mean over measured joints [mm].

    A zero-phase Butterworth filter of fourth order (second order, forth and back) takes the movement away. None where
    the solve is too slow or too short for it.
    """
    positions, _ = matched.pick(matched.joints)
    if matched.rate_hz < 3 * JITTER_HZ or len(positions) < matched.rate_hz:
        return None
    positions = np.nan_to_num(positions)
    smooth = sosfiltfilt(butter(2, JITTER_HZ, fs=matched.rate_hz, output="sos"), positions, axis=0)
    squares = ((positions - smooth) ** 2).sum(axis=2)
    return float(np.sqrt(squares.mean(axis=0)).mean() * 1e3)

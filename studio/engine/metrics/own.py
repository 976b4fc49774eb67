"""Figures of a solve alone, without a reference: jitter, foot slide and bone lengths."""

import numpy as np
from scipy.signal import butter, sosfiltfilt

from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.metrics.figures.bones import bone_length_sd_mm
from studio.engine.metrics.figures.feet import foot_slides_cm_s
from studio.engine.metrics.figures.smoothness import jerk_m_s3
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.matching import Matched, match
from studio.engine.metrics.reference.reference import Reference
from studio.engine.metrics.results import OwnFigures
from studio.engine.model.poses import Poses

JITTER_HZ = 6.0
"""Cutoff between movement and jitter; joints of a moving human stay below it. Source: Winter, "Biomechanics and Motor
Control of Human Movement", 2009, section 3.4.4.
"""


def own_figures(poses: Poses, *, start_s: float | None = None) -> OwnFigures:
    """Return the figures of a solve by itself.

    Args:
        poses: the solve.
        start_s: stage time before which nothing counts (a take's calibration part).

    Raises:
        FormatError: fewer than 4 frames, or fewer than 3 measured joints.
    """
    matched = _with_itself(poses, start_s)
    return {
        "jitter_mm": jitter_mm(matched),
        "jerk_m_s3": jerk_m_s3(matched),
        "own_stance_foot_slide_cm_s": foot_slides_cm_s(matched)[0],
        "bone_length_sd_mm": bone_length_sd_mm(matched),
        "unseen_share": float(1.0 - matched.seen[:, matched.columns(matched.joints)].mean()),
        **solve_cleanup(poses, start_s=start_s),
        "frames": len(matched.time_s),
    }


def own_stance_foot_slide_cm_s(poses: Poses, *, start_s: float | None = None) -> float | None:
    """Return the mean horizontal speed of ankles and toes while the solve's own are low and slow [cm/s].

    It misses the slide of a foot that never rests. None where no foot stands. Arguments and errors as
    `own_figures`.
    """
    return foot_slides_cm_s(_with_itself(poses, start_s))[0]


def _with_itself(poses: Poses, start_s: float | None) -> Matched:
    return match(poses, Reference(poses.time_s, canonical_positions(poses)), start_s=start_s)


def jitter_mm(matched: Matched) -> float | None:
    """Root mean square of a joint's movement above 6 Hz, as the mean over measured joints [mm].

    A zero-phase Butterworth filter of fourth order (second order, forwards and backwards) removes slower movement.
    None if the solve's rate is too low or the solve is too short for it.
    """
    positions, _ = matched.pick(matched.joints)
    if matched.rate_hz < 3 * JITTER_HZ or len(positions) < matched.rate_hz:
        return None
    positions = np.nan_to_num(positions)
    smooth = sosfiltfilt(butter(2, JITTER_HZ, fs=matched.rate_hz, output="sos"), positions, axis=0)
    squares = ((positions - smooth) ** 2).sum(axis=2)
    return float(np.sqrt(squares.mean(axis=0)).mean() * 1e3)

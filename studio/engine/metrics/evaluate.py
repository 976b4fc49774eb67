"""All figures of a solve against a reference, with the keys and units of `evaluate --json`."""

from typing import Any

from studio.engine.joints import CANONICAL
from studio.engine.metrics import thesis
from studio.engine.metrics.alignment import align, clock_of
from studio.engine.metrics.bones import bone_length_sd_mm
from studio.engine.metrics.feet import foot_slides_cm_s
from studio.engine.metrics.honesty import uncertainty_coverage, uncertainty_median_ratio
from studio.engine.metrics.latency import latency_ms
from studio.engine.metrics.matching import Matched, match
from studio.engine.metrics.position import mpjpe_mm, mpjpe_root_aligned_mm, per_joint_mm, rms_mm
from studio.engine.metrics.reference import Reference
from studio.engine.metrics.smoothness import acceleration_error_m_s2, jerk_m_s3, reference_jerk_m_s3
from studio.engine.poses import Poses


def evaluate(
    poses: Poses, reference: Reference, *, start_s: float | None = None, same_clock: bool = True
) -> dict[str, Any]:
    """Return the figures of one solve, each key with its unit; None = not measured.

    Args:
        poses: the solve.
        reference: what it is measured against.
        start_s: stage time before which nothing counts (a take's calibration part).
        same_clock: the reference has the stage clock. Otherwise its offset and drift are estimated, aligned
            away and reported (`time_offset_ms` at stage time 0, positive = the reference's clock is ahead);
            the latency cannot be told from the offset then.

    Raises:
        FormatError: solve and reference share too little time or too few joints.
    """
    offset_s, drift_ppm = (0.0, 0.0) if same_clock else clock_of(poses, reference, start_s=start_s)
    matched, _ = align(match(poses, reference, start_s=start_s, offset_s=offset_s, drift_ppm=drift_ppm))
    foot_slide, reference_foot_slide = foot_slides_cm_s(matched)
    return {
        "mpjpe_mm": mpjpe_mm(matched),
        "matched_joints": matched.joints,
        "mpjpe_root_aligned_mm": mpjpe_root_aligned_mm(matched),
        "per_joint_mm": per_joint_mm(matched, [name for name in CANONICAL if matched.has(name)]),
        "rms_mm": rms_mm(matched),
        "acceleration_error_m_s2": acceleration_error_m_s2(matched),
        "latency_ms": latency_ms(matched, reference) if same_clock else None,
        **_thesis_figures(matched),
        "jerk_m_s3": jerk_m_s3(matched),
        "reference_jerk_m_s3": reference_jerk_m_s3(matched),
        "foot_slide_cm_s": foot_slide,
        "reference_foot_slide_cm_s": reference_foot_slide,
        "bone_length_sd_mm": bone_length_sd_mm(matched),
        "unseen_share": float(1.0 - matched.seen[:, matched.columns(matched.joints)].mean()),
        "uncertainty_coverage": uncertainty_coverage(matched),
        "uncertainty_median_ratio": uncertainty_median_ratio(matched),
        "cleanup_events_per_min": None,
        "time_offset_ms": offset_s * 1e3,
        "clock_drift_ppm": drift_ppm,
        "frames": len(matched.time_s),
    }


def _thesis_figures(matched: Matched) -> dict[str, float | None]:
    """The thesis's four figures, None where the reference lacks chest or wrists."""
    curves = thesis.wrist_curves(matched)
    if curves is None or curves[0].shape[1] < 2:
        return dict.fromkeys(
            ("absolute_difference_cm", "shortest_distance_cm", "spike_difference", "deviations"), None
        )
    solve, reference = curves
    return {
        "absolute_difference_cm": thesis.absolute_difference_cm(solve, reference),
        "shortest_distance_cm": thesis.shortest_distance_cm(solve, reference),
        "spike_difference": thesis.spike_difference(solve, reference, matched.rate_hz),
        "deviations": thesis.deviations(solve, reference, matched.rate_hz),
    }

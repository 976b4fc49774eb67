"""All figures of a solve against a reference, with the keys and units of `evaluate --json`."""

from dataclasses import replace

import numpy as np

from studio.engine.metrics.cleanup.solve import cleanup_figures, part_of
from studio.engine.metrics.figures import thesis
from studio.engine.metrics.figures.angles import joint_angle_errors_deg
from studio.engine.metrics.figures.bones import bone_length_sd_mm
from studio.engine.metrics.figures.contacts import contact_precision_recall, foot_heights_cm
from studio.engine.metrics.figures.feet import foot_slides_cm_s
from studio.engine.metrics.figures.honesty import uncertainty_coverage, uncertainty_median_ratio
from studio.engine.metrics.figures.latency import latency_ms
from studio.engine.metrics.figures.pck import pck
from studio.engine.metrics.figures.position import mpjpe_mm, mpjpe_root_aligned_mm, per_joint_mm, rms_mm
from studio.engine.metrics.figures.smoothness import acceleration_error_m_s2, jerk_m_s3, reference_jerk_m_s3
from studio.engine.metrics.figures.spectral_arc import spectral_arc_lengths
from studio.engine.metrics.own import own_stance_foot_slide_cm_s
from studio.engine.metrics.reference.alignment import Alignment, align
from studio.engine.metrics.reference.clock import on_one_clock
from studio.engine.metrics.reference.matching import Matched, match
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.metrics.results import AngleFigures, Evaluation, FiguresOfBoth
from studio.engine.model.joints import CANONICAL
from studio.engine.model.poses import Poses

ALIGNMENTS: tuple[str, ...] = ("rigid", "similarity")


def evaluate(
    poses: Poses,
    reference: Reference | Markers,
    *,
    start_s: float | None = None,
    same_clock: bool = True,
    similarity: bool = False,
    alignment: Alignment | None = None,
) -> Evaluation:
    """Return the figures of one solve.

    Args:
        poses: the solve.
        reference: the reference; markers' offsets from the joints are fitted first.
        start_s: stage time before which nothing counts (a take's calibration part).
        same_clock: the reference has the stage clock. Otherwise its offset and drift are estimated, aligned
            away and reported (`time_offset_ms` at stage time 0, positive = the reference's clock is ahead);
            latency and offset cannot be separated then.
        similarity: align the size too.
        alignment: use this common alignment of all performers.

    Raises:
        FormatError: solve and reference share too little time or too few joints.
    """
    centres, offsets_mm, clock = on_one_clock(poses, reference, start_s, same_clock)
    matched = match(poses, centres, start_s=start_s, offset_s=clock[0], drift_ppm=clock[1])
    if alignment is None:
        matched, alignment = align(matched, similarity=similarity)
    else:
        matched = replace(matched, solve_m=alignment.to_reference(matched.solve_m))
    alignment = replace(alignment, offset_s=clock[0], drift_ppm=clock[1])
    return {
        "mpjpe_mm": mpjpe_mm(matched),
        "matched_joints": matched.joints,
        "mpjpe_root_aligned_mm": mpjpe_root_aligned_mm(matched),
        "per_joint_mm": per_joint_mm(matched, [name for name in CANONICAL if matched.has(name)]),
        "rms_mm": rms_mm(matched),
        "acceleration_error_m_s2": acceleration_error_m_s2(matched),
        "latency_ms": latency_ms(matched, centres) if same_clock else None,
        **thesis.figures(matched),
        "thesis_joints": {joint: thesis.figures(matched, joint) for joint in ("elbow", "shoulder")},
        "jerk_m_s3": jerk_m_s3(matched),
        "reference_jerk_m_s3": reference_jerk_m_s3(matched),
        **_of_both(matched),
        "own_stance_foot_slide_cm_s": own_stance_foot_slide_cm_s(poses, start_s=start_s),
        "bone_length_sd_mm": bone_length_sd_mm(matched),
        "unseen_share": float(1.0 - matched.seen[:, matched.columns(matched.joints)].mean()),
        "uncertainty_coverage": uncertainty_coverage(matched),
        "uncertainty_median_ratio": uncertainty_median_ratio(matched),
        "pck_50mm": pck(matched, 50.0),
        "pck_100mm": pck(matched, 100.0),
        "pck_150mm": pck(matched, 150.0),
        **_angles(matched),
        **cleanup_figures(part_of(poses, matched.time_s), centres, alignment),
        "alignment": {
            "kind": "similarity" if similarity else "rigid",
            **alignment.to_json(),
            "marker_offsets_mm": offsets_mm,
        },
        "time_offset_ms": clock[0] * 1e3,
        "clock_drift_ppm": clock[1],
        "frames": len(matched.time_s),
    }


def _of_both(matched: Matched) -> FiguresOfBoth:
    slide, reference_slide = foot_slides_cm_s(matched)
    arc, reference_arc = spectral_arc_lengths(matched)
    height, height_error = foot_heights_cm(matched)
    precision, recall = contact_precision_recall(matched)
    return {
        "spectral_arc_length": arc,
        "reference_spectral_arc_length": reference_arc,
        "foot_slide_cm_s": slide,
        "reference_foot_slide_cm_s": reference_slide,
        "foot_height_cm": height,
        "foot_height_error_cm": height_error,
        "contact_precision": precision,
        "contact_recall": recall,
    }


def _angles(matched: Matched) -> AngleFigures:
    errors = joint_angle_errors_deg(matched.solve_m, matched.reference_m)
    flexions = [value["error_deg"] for name, value in errors.items() if name.endswith("flexion")]
    return {
        "joint_angle_error_deg": float(np.mean([value["error_deg"] for value in errors.values()]))
        if errors
        else None,
        "flexion_error_deg": float(np.mean(flexions)) if flexions else None,
        "joint_angles": errors,
    }

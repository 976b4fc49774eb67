"""Figures of a solve, as in `evaluate --json`, the API and files. Units are in the keys.

These types are separate from the code that measures, which is slow to load.
"""

from typing import TypedDict

from msgspec import Struct


class CleanupEventJson(TypedDict):
    """A `CleanupEvent` as in `evaluate --json`."""

    kind: str
    joint: str
    start_s: float
    end_s: float
    peak_s: float
    size: float
    unit: str
    detail: str


class Cleanup(TypedDict):
    """The edit list: events per minute, numbers by kind, and the events; all null for joints without a hierarchy."""

    cleanup_events_per_min: float | None
    cleanup_counts: dict[str, int] | None
    cleanup_events: list[CleanupEventJson] | None


class AlignmentJson(TypedDict):
    """An `Alignment` as JSON: `rotation_deg` is the angle of the rotation; the reference's clock is `time_offset_ms`
    ahead at stage time 0."""

    rotation_wxyz: list[float]
    rotation_deg: float
    translation_m: list[float]
    scale: float
    time_offset_ms: float
    clock_drift_ppm: float


class Aligned(AlignmentJson):
    """The alignment with a reference, `rigid` or `similarity`, and offsets of markers from the joints [mm]; null for
    joint centres."""

    kind: str
    marker_offsets_mm: dict[str, float] | None


class ThesisFigures(TypedDict):
    """The thesis's figures of one joint, measured by the functions of the same names; null without curves."""

    absolute_difference_cm: float | None
    shortest_distance_cm: float | None
    spike_difference: float | None
    deviations: float | None
    nearest_sample_cm: float | None


class AngleError(TypedDict):
    """Mean absolute difference and mean difference of a joint angle [deg].

    An offset as large as the error comes from two skeletons with different definitions of a joint.
    """

    error_deg: float
    offset_deg: float


class OwnFigures(Cleanup):
    """The figures of a solve by itself, with units in the keys; null = not measurable here.

    `own_stance_foot_slide_cm_s` is not the `foot_slide_cm_s` of an `Evaluation`, which uses the reference's stances.
    """

    jitter_mm: float | None
    jerk_m_s3: float | None
    own_stance_foot_slide_cm_s: float | None
    bone_length_sd_mm: float | None
    unseen_share: float
    frames: int


class FiguresOfBoth(TypedDict):
    """Figures measured on both solve and reference, and contacts: precision and recall."""

    spectral_arc_length: float | None
    reference_spectral_arc_length: float | None
    foot_slide_cm_s: float | None
    reference_foot_slide_cm_s: float | None
    foot_height_cm: float | None
    foot_height_error_cm: float | None
    contact_precision: float | None
    contact_recall: float | None


class AngleFigures(TypedDict):
    """Joint angle errors: mean of all, mean of flexions [deg], and each angle's."""

    joint_angle_error_deg: float | None
    flexion_error_deg: float | None
    joint_angles: dict[str, AngleError]


class Evaluation(ThesisFigures, FiguresOfBoth, AngleFigures, Cleanup):
    """All figures of a solve against a reference, as in `evaluate --json`: units in the keys; null = not measurable.

    Attributes:
        mpjpe_mm: mean distance of the joints; `mpjpe_root_aligned_mm` with the hips of both at the same place.
        pck_50mm, pck_100mm, pck_150mm: shares of joints within this distance, 0..1.
        thesis_joints: the thesis's figures of `elbow` and `shoulder`; those of the wrist are separate keys.
        own_stance_foot_slide_cm_s: as in `OwnFigures`.
        unseen_share: of the measured joints, 0..1.
        uncertainty_coverage: share of errors inside the 90 % ball; `uncertainty_median_ratio`: ball over error.
        time_offset_ms, clock_drift_ppm: of the reference's clock, as in `alignment`.
    """

    mpjpe_mm: float
    matched_joints: list[str]
    mpjpe_root_aligned_mm: float | None
    per_joint_mm: dict[str, float]
    rms_mm: float
    acceleration_error_m_s2: float | None
    latency_ms: float | None
    thesis_joints: dict[str, ThesisFigures]
    jerk_m_s3: float | None
    reference_jerk_m_s3: float | None
    own_stance_foot_slide_cm_s: float | None
    bone_length_sd_mm: float | None
    unseen_share: float
    uncertainty_coverage: float | None
    uncertainty_median_ratio: float | None
    pck_50mm: float
    pck_100mm: float
    pck_150mm: float
    alignment: Aligned
    time_offset_ms: float
    clock_drift_ppm: float
    frames: int


class SeveralEvaluation(TypedDict):
    """Figures of a solve of several performers against their references.

    Attributes:
        performers: each one's figures, by name, with one alignment for all.
        identity_switches: number of times that a solved performer changes from one reference to another.
        missed_percent: share of the references' frames without a pose, while a camera recorded.
        undecided_percent: share of the references' frames in which the solve reports that it cannot tell who is who.
    """

    performers: dict[str, Evaluation]
    identity_switches: int
    missed_percent: float
    undecided_percent: float


class Apart(Struct):
    """An instant at which two motions differ: stage time [s], the joint furthest apart, and its distance [mm]."""

    time_s: float
    joint: str
    mm: float


class DifferenceSummary(Struct):
    """Distances between two motions [mm] over the solve's common frames: mean, 95th percentile, largest, means by
    joint, and the instants with the largest, at least half a second apart."""

    frames: int
    mean_mm: float
    p95_mm: float
    max_mm: float
    per_joint_mm: dict[str, float]
    worst: list[Apart]


class DifferencesOverTime(DifferenceSummary, kw_only=True):
    """Distances between two motions [mm], also over time, at the solve's `frame`, thinned without losing peaks.

    Attributes:
        alignment: alignment of another solve; null for a reference.
        aligned: alignment of a reference; null for a solve.
        mean_over_joints_mm, joints_mm: at each of `frame`, by joint; null where unknown.
    """

    alignment: AlignmentJson | None
    aligned: Aligned | None
    frame: list[int]
    mean_over_joints_mm: list[float | None]
    joints_mm: dict[str, list[float | None]]
    per_joint_p95_mm: dict[str, float]
    per_joint_max_mm: dict[str, float]


class SolveFigures(Struct):
    """A solve's figures: its own, and those against a reference (null without one)."""

    own: OwnFigures
    reference: Evaluation | None

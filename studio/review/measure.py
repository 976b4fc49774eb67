"""Quality of a take's solve for reviewers: figures, edit list, differences from another motion."""

import itertools
from pathlib import Path

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.metrics.compare import compare, differences
from studio.engine.metrics.own import own_figures
from studio.engine.metrics.reference.alignment import Alignment
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.placing import PlacedMotion, line_up, on_stage
from studio.engine.metrics.reference.reference import Reference, read_reference
from studio.engine.metrics.results import (
    Aligned,
    AlignmentJson,
    Cleanup,
    DifferencesOverTime,
    DifferenceSummary,
    Evaluation,
    SolveFigures,
)
from studio.engine.model.poses import Poses
from studio.take.folder.evaluating import evaluate_poses
from studio.take.folder.placing import place_reference
from studio.take.folder.references import HowAligned
from studio.take.folder.take import Take

MAX_SAMPLES = 1200
"""Maximum number of instants with differences; longer takes are thinned."""


def solve_figures(
    take: Take, poses: Path, reference: Path | None = None, how: HowAligned | None = None
) -> SolveFigures:
    """Return figures of the solve in a take's `poses.npz`.

    Args:
        reference: file of the reference; None = none.
        how: options of its alignment; None = `HowAligned()`.

    Raises:
        FormatError: a file that cannot be read.
        StudioError: the two cannot be aligned.
    """
    solve = Poses.load(poses)
    against = None if reference is None else _against(take, solve, reference, how)
    return SolveFigures(own_figures(solve, start_s=take.meta["calibration_s"]), against)


def edit_list(
    take: Take, poses: Path, reference: Path | None = None, how: HowAligned | None = None
) -> Cleanup:
    """Return the clean-up events of the solve; arguments and errors as `solve_figures`. A reference separates true
    motion from errors.
    """
    solve = Poses.load(poses)
    if reference is None:
        return solve_cleanup(solve, start_s=take.meta["calibration_s"])
    found = _against(take, solve, reference, how)
    return {
        "cleanup_events_per_min": found["cleanup_events_per_min"],
        "cleanup_counts": found["cleanup_counts"],
        "cleanup_events": found["cleanup_events"],
    }


def _against(take: Take, solve: Poses, reference: Path, how: HowAligned | None) -> Evaluation:
    how = how or HowAligned()
    return evaluate_poses(take, solve, read_reference(reference, unit_m=how.unit_m), how)


def compare_solves(a: Path, b: Path) -> DifferenceSummary:
    """Return the differences of the solves in two `poses.npz`; results and errors as `metrics.compare.compare`."""
    return compare(Poses.load(a), Poses.load(b))


def solve_differences(
    take: Take, a: Path, b: Path, *, another_take: bool, lined_up: bool, offset_ms: float
) -> DifferencesOverTime:
    """Return the differences of two solves over time.

    Args:
        take: of `a`.
        a, b: files `poses.npz`.
        another_take: `b` is from another take; both begin together.
        lined_up: align `b` in place and time with `a` instead.
        offset_ms: further offset of `b`, positive = ahead.

    Raises:
        FormatError: a file that cannot be read, or no instant or joint in common.
    """
    solve, other = Poses.load(a), Poses.load(b)
    alignment = Alignment(np.eye(4))
    if lined_up:
        alignment = line_up(solve, other, start_s=take.meta["calibration_s"])
    elif another_take:
        alignment = Alignment(np.eye(4), offset_s=other.begins_s - solve.begins_s)
    motion = on_stage(Reference(other.time_s, canonical_positions(other)), alignment)
    return _differences(solve, motion, offset_ms, alignment.to_json(), None)


def reference_differences(
    take: Take, a: Path, reference: Path, how: HowAligned, kept: Path, *, offset_ms: float
) -> DifferencesOverTime:
    """Return the differences of a solve from a reference over time.

    Args:
        take, a, offset_ms: as in `solve_differences`, also for errors.
        reference: file of the reference.
        how: options of its alignment.
        kept: file of the reference in the stage frame of `a`.
    """
    if not kept.is_file():
        place_reference(take, a, reference, how, kept)
    placed = PlacedMotion.load(kept)
    return _differences(Poses.load(a), placed.motion, offset_ms, None, placed.aligned)


def _differences(
    solve: Poses,
    motion: Reference,
    offset_ms: float,
    alignment: AlignmentJson | None,
    aligned: Aligned | None,
) -> DifferencesOverTime:
    """Return differences at up to `MAX_SAMPLES` instants: the largest of each interval, so that no peak is lost."""
    found = differences(solve, Reference(motion.time_s - offset_ms * 1e-3, motion.positions_m))
    count = len(found.frames)
    edges = np.unique(np.linspace(0, count, min(count, MAX_SAMPLES) + 1).round().astype(int))
    mean = np.nanmean(found.mm, axis=1)
    rows = [int(low + np.argmax(mean[low:high])) for low, high in itertools.pairwise(edges)]

    def numbers(values: NDArray[np.float64]) -> list[float | None]:
        return [None if not np.isfinite(value) else round(float(value), 1) for value in values]

    by_joint = dict(zip(found.joints, found.mm.T, strict=True))
    return DifferencesOverTime(
        **structs.asdict(found.summary()),
        alignment=alignment,
        aligned=aligned,
        frame=found.frames[rows].tolist(),
        mean_over_joints_mm=numbers(mean[rows]),
        joints_mm={name: numbers(mm[rows]) for name, mm in by_joint.items()},
        per_joint_p95_mm={name: float(np.nanpercentile(mm, 95)) for name, mm in by_joint.items()},
        per_joint_max_mm={name: float(np.nanmax(mm)) for name, mm in by_joint.items()},
    )

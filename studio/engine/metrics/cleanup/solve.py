"""The clean-up of a solve: its exported animation against a reference, where there is one."""

from typing import Any

import numpy as np

from studio.engine.export.clip import frames_of
from studio.engine.metrics.alignment import Alignment, align
from studio.engine.metrics.cleanup import KINDS, cleanup_events, events_per_min, shown_animation
from studio.engine.metrics.markers import fit_joint_centres
from studio.engine.metrics.matching import match
from studio.engine.metrics.reference import Markers, Reference
from studio.engine.poses import Poses


def solve_cleanup(
    poses: Poses, reference: Reference | Markers | None, *, start_s: float | None = None
) -> dict[str, Any]:
    """Return `cleanup_events_per_min`, `cleanup_counts` and `cleanup_events`, as `evaluate` has them.

    Args:
        poses: the solve.
        reference: on the stage clock; None = none. True motion that is very sharp then counts too.
        start_s: stage time before which nothing counts (a take's calibration part).

    Raises:
        FormatError: solve and reference share too little time or too few joints; a solve that cannot be exported.
    """
    if reference is None:
        first = 0 if start_s is None else int(np.searchsorted(poses.time_s, start_s))
        return cleanup_figures(frames_of(poses, slice(first, poses.frame_count)), None, None)
    if isinstance(reference, Markers):
        reference, _ = fit_joint_centres(poses, reference, start_s=start_s)
    matched, alignment = align(match(poses, reference, start_s=start_s))
    return cleanup_figures(part_of(poses, matched.time_s), reference, alignment)


def part_of(poses: Poses, time_s: np.ndarray) -> Poses:
    """Return the poses from the first to the last of these instants of theirs."""
    first, last = np.searchsorted(poses.time_s, time_s[[0, -1]])
    return frames_of(poses, slice(first, last + 1))


def cleanup_figures(poses: Poses, reference: Reference | None, alignment: Alignment | None) -> dict[str, Any]:
    """Return the clean-up of these poses; None each where they are joints without a hierarchy, no animation.

    Args:
        poses: the part of a solve that counts.
        reference: what they are compared with, and how it lies to the stage; None = nothing.
    """
    if (poses.parents < 0).sum() != 1 or poses.frame_count < 2:
        return {"cleanup_events_per_min": None, "cleanup_counts": None, "cleanup_events": None}
    shown = shown_animation(poses)
    beside = None
    if reference is not None and alignment is not None:
        clock = shown.time_s + alignment.offset_s + alignment.drift_ppm * 1e-6 * shown.time_s
        beside = alignment.to_stage(reference.at(clock))
    events = cleanup_events(shown, beside)
    return {
        "cleanup_events_per_min": events_per_min(events, shown),
        "cleanup_counts": {kind: sum(event.kind == kind for event in events) for kind in KINDS},
        "cleanup_events": [event.to_json() for event in events],
    }

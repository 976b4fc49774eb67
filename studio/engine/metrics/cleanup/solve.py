"""The clean-up of a solve's exported animation, by itself or against a reference."""

import numpy as np

from studio.engine.animation.clip.clip import frames_of
from studio.engine.metrics.cleanup import KINDS, cleanup_events, events_per_min, shown_animation
from studio.engine.metrics.reference.alignment import Alignment
from studio.engine.metrics.reference.reference import Reference
from studio.engine.metrics.results import Cleanup
from studio.engine.model.poses import Poses


def solve_cleanup(poses: Poses, *, start_s: float | None = None) -> Cleanup:
    """Return the clean-up of a solve without a reference; very sharp true motion counts too.

    Args:
        poses: the solve.
        start_s: stage time before which nothing counts (a take's calibration part).

    Raises:
        FormatError: a solve that cannot be exported.
    """
    first = 0 if start_s is None else int(np.searchsorted(poses.time_s, start_s))
    return cleanup_figures(frames_of(poses, slice(first, poses.frame_count)), None, None)


def part_of(poses: Poses, time_s: np.ndarray) -> Poses:
    """Return the poses from the first to the last of these instants."""
    first, last = np.searchsorted(poses.time_s, time_s[[0, -1]])
    return frames_of(poses, slice(first, last + 1))


def cleanup_figures(poses: Poses, reference: Reference | None, alignment: Alignment | None) -> Cleanup:
    """Return the clean-up of these poses; joints without a hierarchy are no animation.

    Args:
        poses: the part of a solve that counts.
        reference: the reference, with its alignment to the stage; None = none.
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

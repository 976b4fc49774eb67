"""Stance slides: a standing foot that moves over 1 cm further across the floor than the reference's does.

A foot stands if it does so in the reference (`feet.stance_of`; without a reference, in the animation itself) and the
animation's foot is low as well. The first and last 0.05 s of a stance are left out, because a foot rolls then. The
slide within a stance is the largest distance [m] of a joint's horizontal path from its start.
Source: foot skating as in Kovar, Schreiner, Gleicher, "Footskate cleanup for motion capture editing", SCA 2002.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.metrics.cleanup.events import CleanupEvent, joined, limb_of
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.metrics.figures.feet import STANCE_HEIGHT_M, stance_of
from studio.engine.model.joints import INDEX

SLIDE_M = 0.01
EDGE_S = 0.05
LEAST_S = 0.1


def stance_slides(shown: ShownMotion, reference_m: NDArray[np.float64] | None) -> list[CleanupEvent]:
    """Return the slides of ankles and toes, one per foot and stance at most.

    Args:
        reference_m: as for `pops.joint_pops`.
    """
    events: list[CleanupEvent] = []
    edge = shown.frames(EDGE_S)
    for side in ("left", "right"):
        for name in ("ankle", "toe"):
            joint = INDEX[f"{side}_{name}"]
            solve = shown.positions_m[:, joint]
            if not np.isfinite(solve).any():
                continue
            reference = solve if reference_m is None else reference_m[:, joint]
            if not np.isfinite(reference).all(axis=1).any():
                continue
            stands = stance_of(reference[:, None], shown.time_s)[:, 0]
            low = solve[:, 2] < np.percentile(solve[:, 2], 5) + STANCE_HEIGHT_M
            for first, last in runs(stands & low):
                first, last = first + edge, last - edge
                if last - first < shown.frames(LEAST_S):
                    continue
                own = wandering_m(solve[first:last])
                beside = 0.0 if reference_m is None else float(wandering_m(reference[first:last]).max())
                if own.max() - beside > SLIDE_M:
                    peak = first + int(np.argmax(own))
                    start_s, end_s, peak_s = (float(shown.time_s[k]) for k in (first, last - 1, peak))
                    events.append(
                        CleanupEvent(
                            "stance_slide",
                            f"{side}_{name}",
                            start_s,
                            end_s,
                            peak_s,
                            float(own.max() - beside) * 100.0,
                            "cm",
                        )
                    )
    return joined(events, lambda event: limb_of(event.joint))


def wandering_m(path_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the horizontal distance of each point from the first [m]; shapes (sample_count, 3), (sample_count,)."""
    return np.linalg.norm((path_m - path_m[0])[:, :2], axis=1)

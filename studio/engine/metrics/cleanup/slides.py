"""Stance slides: a standing foot that wanders over 1 cm further across the floor than the reference's does.

A foot stands where the reference says so (`feet.stance_of`; without a reference where the animation itself does)
and the animation's foot is low as well; the first and last 0.05 s of a stance are left out, in which a foot rolls.
How far a joint wanders within a stance is the largest distance [m] of its horizontal path from where it begins.
Source: foot skating as in Kovar, Schreiner, Gleicher, "Footskate cleanup for motion capture editing", SCA 2002.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.joints import INDEX
from studio.engine.metrics.cleanup.events import Event, joined, limb_of, runs
from studio.engine.metrics.cleanup.shown import Shown
from studio.engine.metrics.feet import STANCE_HEIGHT_M, stance_of

SLIDE_M = 0.01
EDGE_S = 0.05
LEAST_S = 0.1


def stance_slides(shown: Shown, reference_m: NDArray[np.float64] | None) -> list[Event]:
    """Return the slides of ankles and toes, one per foot and stance at most.

    Args:
        reference_m: as for `pops.joint_pops`.
    """
    events: list[Event] = []
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
                    events.append(
                        Event(
                            "stance_slide",
                            f"{side}_{name}",
                            *(float(shown.time_s[k]) for k in (first, last - 1, peak)),
                            float(own.max() - beside) * 100.0,
                            "cm",
                        )
                    )
    return joined(events, lambda event: limb_of(event.joint))


def wandering_m(path_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the horizontal distance of each place from the first [m]; shapes (sample_count, 3), (sample_count,)."""
    return np.linalg.norm((path_m - path_m[0])[:, :2], axis=1)

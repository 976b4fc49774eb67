"""Clean-up: an edit list of errors in the exported animation that an animator would correct.

shown.py    the animation as played from its exported keys
events.py   an event: kind, joint, time, size
pops.py     joints that jump off their path
flips.py    limbs that flip, and swaps of left and right
slides.py   standing feet that slide
floor.py    joints under the floor
overlap.py  body parts inside one another
frozen.py   limbs that stop
solve.py    the whole edit list for a solve and a reference
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.cleanup.events import KINDS, CleanupEvent
from studio.engine.metrics.cleanup.flips import limb_flips
from studio.engine.metrics.cleanup.floor import floor_penetrations
from studio.engine.metrics.cleanup.frozen import frozen_limbs
from studio.engine.metrics.cleanup.overlap import self_penetrations
from studio.engine.metrics.cleanup.pops import joint_pops
from studio.engine.metrics.cleanup.shown import ShownMotion, shown_animation
from studio.engine.metrics.cleanup.slides import stance_slides

__all__ = ["KINDS", "CleanupEvent", "ShownMotion", "cleanup_events", "events_per_min", "shown_animation"]


def cleanup_events(shown: ShownMotion, reference_m: NDArray[np.float64] | None = None) -> list[CleanupEvent]:
    """Return the edit list of an animation, by time.

    Args:
        shown: the animation (`shown_animation`).
        reference_m: canonical joints at the animation's times in the stage frame [m], shape
            (sample_count, 21, 3), NaN = unknown. Without a reference, very sharp true motion counts too.
    """
    events = [
        *joint_pops(shown, reference_m),
        *limb_flips(shown, reference_m),
        *stance_slides(shown, reference_m),
        *floor_penetrations(shown),
        *self_penetrations(shown, reference_m),
        *frozen_limbs(shown, reference_m),
    ]
    return sorted(events, key=lambda event: (event.start_s, KINDS.index(event.kind), event.joint))


def events_per_min(events: list[CleanupEvent], shown: ShownMotion) -> float:
    """Return the number of events per minute of the animation."""
    return len(events) * 60.0 / float(shown.time_s[-1] - shown.time_s[0])

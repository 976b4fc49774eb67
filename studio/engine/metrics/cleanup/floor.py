"""Floor penetration: a sole, hand, knee or any other joint over 1 cm under the floor of the exported file.

A foot has two soles: the point on the floor under the ankle in the T-pose, and the point under the ball of the
foot. Both turn with the foot. For all other parts the joint itself counts. The
export's rest pose stands on its soles (`studio.engine.model.soles`).
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.cleanup.events import CleanupEvent, events_of, joined, limb_of
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.model.joints import CANONICAL, INDEX

DEPTH_M = 0.01


def floor_penetrations(shown: ShownMotion) -> list[CleanupEvent]:
    """Return the floor penetrations, one event per limb at a time."""
    events: list[CleanupEvent] = []
    for name in CANONICAL:
        depth = -_lowest_m(shown, name)
        events += events_of(
            "floor_penetration", name, shown.time_s, depth * 100.0, depth > DEPTH_M, unit="cm"
        )
    return joined(events, lambda event: limb_of(event.joint))


def _lowest_m(shown: ShownMotion, name: str) -> NDArray[np.float64]:
    """Height of a joint's lowest point [m], shape (sample_count,): of the sole for feet, else of the joint."""
    joint = INDEX[name]
    height = shown.positions_m[:, joint, 2]
    if name.endswith(("ankle", "toe")):
        down = np.array([0.0, 0.0, -shown.rest_m[joint, 2]])
        return height + (shown.rotations[:, joint] @ down)[:, 2]
    return height

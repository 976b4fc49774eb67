"""Floor penetration: a sole, hand, knee or any other joint over 1 cm under the floor of the exported file.

A sole is the point that lies on the floor under the ankle in the T-pose, and the one under the ball of the
foot; both turn with the foot. Hips, hands and all else are under the floor where the joint itself is. The
export's rest pose stands on its soles (`studio.engine.soles`).
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.joints import CANONICAL, INDEX
from studio.engine.metrics.cleanup.events import Event, events_of, joined, limb_of
from studio.engine.metrics.cleanup.shown import Shown

DEPTH_M = 0.01


def floor_penetrations(shown: Shown) -> list[Event]:
    """Return where the body is under the floor, one event per limb at a time."""
    events: list[Event] = []
    for name in CANONICAL:
        depth = -_lowest_m(shown, name)
        events += events_of(
            "floor_penetration", name, shown.time_s, depth * 100.0, depth > DEPTH_M, unit="cm"
        )
    return joined(events, lambda event: limb_of(event.joint))


def _lowest_m(shown: Shown, name: str) -> NDArray[np.float64]:
    """Height of what belongs to a joint [m], shape (sample_count,): of the sole for feet, else of the joint."""
    joint = INDEX[name]
    height = shown.positions_m[:, joint, 2]
    if name.endswith(("ankle", "toe")):
        down = np.array([0.0, 0.0, -shown.rest_m[joint, 2]])
        return height + (shown.rotations[:, joint] @ down)[:, 2]
    return height

"""The embedded performers on one stage, for cameras in real time: a loop of calibration walk and meeting.

The first walks alone for two calibrations, so that one may begin at any time of the first half. The others enter, and
all hold a T-pose side by side. Then they change places; each performs in a different order.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.authored import calibration_motion, demo_motion
from studio.engine.animation.motion.keys import RATE_HZ
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.model.joints import INDEX
from studio.simulator.crowd.meeting import Meeting, meet

MOST_PERFORMERS = 4
_BODIES = ((1.0, 1.0), (0.91, 0.96), (1.06, 1.03), (1.03, 0.92))
"""Per performer: size relative to the embedded performer, and a further factor of the leg length."""

_RETURN_S = 1.5
"""Time in which the first returns to the start of the loop."""

_LEGS = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("knee", "ankle")]


def body_of(who: int) -> NDArray[np.float64]:
    """Return the T-pose offsets of a performer's body, by number from 0 [m], shape (21, 3)."""
    size, legs = _BODIES[who]
    offsets = AUTHORED_OFFSETS * size
    longer = (legs - 1.0) * offsets[_LEGS]
    offsets[_LEGS] += longer
    offsets[INDEX["hips"], 2] -= longer[:2, 2].sum()
    return offsets


def crowd_stage(count: int) -> Meeting:
    """Return the loop of 2 to `MOST_PERFORMERS` performers."""
    motions = [demo_motion(body_of(who), begins_with=2 * who) for who in range(count)]
    meeting = meet(motions, "passing")
    alone = calibration_motion(motions[0].offsets_m).positions_m
    first, *others = meeting.motions
    share = np.linspace(0.0, 1.0, round(_RETURN_S * RATE_HZ))[:, None, None]
    back = first.positions_m[-1] + share * (alone[0] - first.positions_m[-1])
    looped = [np.concatenate([alone, first.positions_m, back])]
    for other in others:
        before = np.repeat(other.positions_m[:1], len(alone), axis=0)
        after = np.repeat(other.positions_m[-1:], len(back), axis=0)
        looped.append(np.concatenate([before, other.positions_m, after]))
    placed = tuple(
        replace(motion, positions_m=positions, hands_open=np.ones((len(positions), 2)))
        for motion, positions in zip(meeting.motions, looped, strict=True)
    )
    alone_s = meeting.calibration_s + len(alone) / RATE_HZ
    return Meeting(placed, (0.0, *[alone_s] * (count - 1)), alone_s)

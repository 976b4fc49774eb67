"""Vertical correction of a retargeted motion's feet, so that standing feet are on the floor."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.foot_lock import EASE_S, eased
from studio.engine.animation.retarget.limbs import Places
from studio.engine.whole_take.finish.contact.contacts import find_contacts

Array = NDArray[np.float64]

STANDS_WITHIN_M = 0.005
"""Largest distance of a standing foot from the floor, as with the performer."""


def floor_shifts(source: Places, source_rest: Places, ratio: float, hz: float) -> dict[str, Array]:
    """Return the lift that puts each foot on the floor [m], by side, shape (F,).

    Stances are found in the motion as in finishing (`finish.contact.contacts`): by the ball of a foot, and by the
    ankle where only the heel stands. The lift is blended in before a stance and out after it. No ball of a
    foot goes through the floor, whether it stands or not.

    Args:
        source: the motion by role; source_rest: its rest pose, the floor at y = 0.
        ratio: of leg lengths, rig to motion.
        hz: frames a second.
    """
    names = [(side, f"{side}Foot", f"{side}ToeBase") for side in ("Left", "Right")]
    columns = [role for _, ankle, ball in names for role in (ankle, ball if ball in source else ankle)]
    frames = len(source["Hips"])
    if frames < 3:
        return {side: np.zeros(frames) for side, _, _ in names}
    rest = np.array([source_rest[role][1] for role in columns])
    feet = np.stack([source[role][:, [0, 2, 1]] for role in columns], axis=1)
    standing = find_contacts(feet, [(0, frames)], 1.0 / hz, rest).hold > 0.0
    above = ratio * (feet[:, :, 2] - rest)
    shift = np.clip(above, -STANDS_WITHIN_M, STANDS_WITHIN_M) - above
    ease = max(1, round(EASE_S * hz))
    out = {}
    for k, (side, _, _) in enumerate(names):
        moves = [eased(shift[:, [c]], standing[:, c], ease)[:, 0] for c in (2 * k, 2 * k + 1)]
        ball = eased(standing[:, [2 * k + 1]].astype(float), standing[:, 2 * k + 1], ease)[:, 0]
        out[side] = ball * moves[1] + (1.0 - ball) * moves[0]
        if f"{side}ToeBase" in source:
            out[side] += np.maximum(0.0, -STANDS_WITHIN_M - (above[:, 2 * k + 1] + out[side]))
    return out

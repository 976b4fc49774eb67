"""Standing feet on the floor: by how much feet move up or down so that those that stand do so on it."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.export.foot_lock import EASE_S, eased
from studio.engine.finish.contacts import find_contacts
from studio.engine.retarget.limbs import Places

Array = NDArray[np.float64]

STANDS_WITHIN_M = 0.005
"""A standing foot may be this far from the floor, as the performer's is."""


def floor_shifts(source: Places, source_rest: Places, ratio: float, hz: float) -> dict[str, Array]:
    """Return by how much each foot comes up so that it stands on the floor [m], by side, shape (F,).

    Stances are found in the motion as finishing finds them (`finish.contacts`): the ball of a foot counts, and the
    ankle where only the heel stands. Before and after a stance the shift comes and goes over a while. No ball of a
    foot sinks through the floor, whether it stands or not.

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

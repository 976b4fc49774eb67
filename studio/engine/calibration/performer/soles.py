"""Heights of ankles and toe joints over the floor when the performer stands flat, which place the soles.

Joint centres of performers, shoes and devices differ by centimetres. The heights are measured on standing feet, and
kept in the performer's T-pose, in which the soles are on the floor; all users of soles take them from there.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.merge import Walk
from studio.engine.model.calibration import Performer
from studio.engine.model.joints import INDEX, MIRROR

ANKLE_RANGE, TOE_RANGE = (0.020, 0.080), (0.005, 0.045)
"""Plausible heights over the floor, as shares of the standing height; measured heights are clamped to these."""

DROP_RANGE = (0.10, 0.60)
"""A foot is flat if the ankle's height over the toe joint, as a share of their distance, is in this range."""

STAND_SPEED_M_S = 0.25
OTHER_FOOT_M = 0.04
"""A foot stands if ankle and toe are slower than the first, and above the other foot's by at most the second."""

LEAST_SHARE = 0.4
"""Minimum share of a standing foot's instants in which it is flat; a dancer on her toes is not measured."""

SIDES = ("left", "right")
LEAST_INSTANTS = 30
SMOOTHING_S = 0.3

STANDS_PERCENT = 40.0
"""Percentile of a standing foot's heights; instants wrongly taken for standing are above it more often than below."""


LOWEST_PERCENT = 10.0
LEVEL_M = 0.04
"""The lowest level on which a performer stands: a standing foot's heights within the second above the first."""


def on_soles(performer: Performer, walk: Walk, *, lowest: bool = False) -> Performer:
    """Return the performer with the heights of feet as they stand in a walk; unchanged if no foot is flat.

    Both sides are the same, and bones keep their lengths. A toe's bone is turned until it drops from the ankle as far
    as in a standing foot, and the T-pose is raised until its ankles are as high as standing ones.

    Args:
        walk: in the stage frame, the floor at z = 0.
        lowest: the lowest of several heights on which the performer stands is the floor: somebody else's feet placed
            the floor, and nobody stands below it.
    """
    known = [foot for side in SIDES if (foot := _standing_foot(walk, side, lowest)) is not None]
    if not known:
        return performer
    offsets, height = performer.offsets_m.copy(), performer.height_m
    ankle, toe_height = np.mean(known, axis=0)
    ankle = np.clip(ankle, *np.array(ANKLE_RANGE) * height)
    toe_height = np.clip(toe_height, *np.array(TOE_RANGE) * height)
    legs = {side: _leg_m(offsets, side) for side in SIDES}
    offsets[0, 2] = ankle + 0.5 * sum(legs.values())
    for side in SIDES:
        toe = INDEX[f"{side}_toe"]
        length = float(np.linalg.norm(offsets[toe]))
        drop = offsets[0, 2] - legs[side] - toe_height  # both toes are on the floor, even if legs differ
        drop = float(np.clip(drop, *np.array(DROP_RANGE) * length))
        along = offsets[toe, :2] / max(float(np.linalg.norm(offsets[toe, :2])), 1e-9)
        offsets[toe] = [*(along * np.sqrt(length**2 - drop**2)), -drop]
    return replace(performer, offsets_m=offsets, soles_measured=True)


def _leg_m(offsets_m: NDArray[np.float64], side: str) -> float:
    """Return the distance of an ankle below the hips in the T-pose [m]."""
    return -float(offsets_m[[INDEX[f"{side}_{name}"] for name in ("hip", "knee", "ankle")], 2].sum())


def _standing_foot(walk: Walk, side: str, lowest: bool) -> tuple[float, float] | None:
    """Return the heights of a standing ankle and its toe [m]; None where the foot was not seen flat."""
    joints, sure = walk.smooth(SMOOTHING_S), walk.sure()
    ankle, toe = INDEX[f"{side}_ankle"], INDEX[f"{side}_toe"]
    stands = np.isfinite(sure[:, [ankle, toe], 2]).all(axis=1)
    if stands.sum() < LEAST_INSTANTS:
        return None
    rate_hz = 1.0 / float(np.median(np.diff(walk.times_s)))
    for joint in (ankle, toe):
        other = joints[:, MIRROR[joint]]
        speed = np.linalg.norm(np.gradient(joints[:, joint], axis=0), axis=1) * rate_hz
        stands &= (speed < STAND_SPEED_M_S) & ~(joints[:, joint, 2] - other[:, 2] > OTHER_FOOT_M)
    if stands.sum() < LEAST_INSTANTS:
        return None
    drop = joints[stands, ankle, 2] - joints[stands, toe, 2]
    length = float(np.median(np.linalg.norm(joints[stands, ankle] - joints[stands, toe], axis=1)))
    flat = (drop > DROP_RANGE[0] * length) & (drop < DROP_RANGE[1] * length)
    if flat.sum() < max(LEAST_INSTANTS, LEAST_SHARE * len(drop)):
        return None
    heights = joints[stands, ankle, 2]
    if lowest:
        flat &= heights < np.percentile(heights[flat], LOWEST_PERCENT) + LEVEL_M
    height = float(np.percentile(heights[flat], STANDS_PERCENT))
    return height, height - float(np.median(drop[flat]))

"""Points of the body that may bear on the floor: soles, knuckles, wrists, elbows, knees, seat, shoulders and head.

A foot has two points under the heel, two under the ball and one at the tip of the toes. Measures are shares of
stature: the foot's from its breadth, 0.055, and length, 0.152 (Drillis & Contini, "Body segment parameters", 1966).
The resting heights of other joints above the floor are estimates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import OUTPUT_INDEX

_HALF_BREADTH = 0.022
_HEEL_BACK = 0.030
_TOE_LENGTH = 0.035

_FLESH = {
    "LeftHand": 0.015, "RightHand": 0.015, "LeftForeArm": 0.025, "RightForeArm": 0.025,
    "LeftLeg": 0.03, "RightLeg": 0.03, "LeftUpLeg": 0.06, "RightUpLeg": 0.06,
    "LeftArm": 0.04, "RightArm": 0.04, "Head": 0.06,
}  # fmt: skip
"""Thickness between a joint and the floor on which it rests."""

SOLE_POINTS = 10
"""Number of sole points, which come first: five of the left foot, five of the right."""


@dataclass(frozen=True)
class FloorPoints:
    """Positions of the points on the body.

    Attributes:
        body_ids: MuJoCo body of each point, shape (point_count,).
        offsets_m: position in the body's frame, shape (point_count, 3).
        flesh_m: height of each above the floor on which it rests, shape (point_count,).
    """

    body_ids: NDArray[np.int64]
    offsets_m: NDArray[np.float64]
    flesh_m: NDArray[np.float64]


def floor_points(humanoid: Humanoid) -> FloorPoints:
    """Return the points of a humanoid, soles first."""
    height = humanoid.skeleton.height_m
    carriers, offsets = _soles(humanoid.skeleton)
    hands = ["LeftHand", "RightHand"]
    knuckles = [humanoid.skeleton.offsets_m[OUTPUT_INDEX[f"{hand}Middle1"]] for hand in hands]
    names = [*carriers, *hands, *_FLESH]
    flesh = [0.0] * len(carriers) + [height * _FLESH[name] for name in (*hands, *_FLESH)]
    return FloorPoints(
        np.array([humanoid.model.body(name).id for name in names]),
        np.array([*offsets, *knuckles, *np.zeros((len(_FLESH), 3))]),
        np.array(flesh),
    )


def _soles(skeleton: Skeleton) -> tuple[list[str], list[NDArray[np.float64]]]:
    """Body and offset of each sole point; a sole lies on the floor in the T-pose."""
    height = skeleton.height_m
    carriers: list[str] = []
    offsets: list[NDArray[np.float64]] = []
    for side in ("Left", "Right"):
        for name, places in (
            ("Foot", ((-_HALF_BREADTH, _HEEL_BACK), (_HALF_BREADTH, _HEEL_BACK))),
            ("ToeBase", ((-_HALF_BREADTH, 0.0), (_HALF_BREADTH, 0.0), (0.0, -_TOE_LENGTH))),
        ):
            down = -skeleton.rest_positions_m[OUTPUT_INDEX[side + name], 2]
            for x, y in places:
                carriers.append(side + name)
                offsets.append(np.array([x * height, y * height, down]))
    return carriers, offsets

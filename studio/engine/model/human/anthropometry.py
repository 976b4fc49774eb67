"""Average proportions: joint positions as shares of the standing height, from the literature."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR

ANKLE_HEIGHT = 0.050
TOE_HEIGHT = 0.025
"""Heights of the centres of the ankle and of the ball of the foot over the floor, as shares of the standing height.

Source: Winter, "Biomechanics and motor control of human movement", 4th edition, figure 4.1 (ankle 0.039 H
without shoes), with 2 cm for a shoe's sole at 1.75 m.
"""

TOP_OF_HEAD = 0.065
"""Top of the head over the head joint (the middle of the head), as a share of the standing height: half of the
0.130 from chin to top in Winter's figure 4.1."""

ANTHROPOMETRIC: dict[str, tuple[float, float, float]] = {
    "hips": (0.0, 0.0, 0.530),
    "spine": (0.0, 0.0, 0.610),
    "chest": (0.0, 0.0, 0.770),
    "neck": (0.0, 0.0, 0.830),
    "head": (0.0, 0.0, 0.935),
    "left_shoulder": (0.129, 0.0, 0.818),
    "left_elbow": (0.315, 0.0, 0.818),
    "left_wrist": (0.461, 0.0, 0.818),
    "left_hand": (0.515, 0.0, 0.818),
    "left_hip": (0.052, 0.0, 0.530),
    "left_knee": (0.052, 0.0, 0.285),
    "left_ankle": (0.052, 0.0, 0.039),
    "left_toe": (0.052, -0.075, 0.015),
}
"""Joints of an average person in a T-pose (left x, back y, up z) as shares of the standing height.

Source: Drillis and Contini, "Body segment parameters", 1966, as in Winter, "Biomechanics and motor control of
human movement", 4th edition, figure 4.1 (upper arm 0.186, forearm 0.146, half hand 0.054, half shoulder width
0.129, shoulder 0.818, hip 0.530, knee 0.285, ankle 0.039, chin 0.870, half of the foot's length 0.075); half the
distance of the hip joints' centres 0.052 from Bell, Pedersen and Brand, "A comparison of the accuracy of several
hip center location prediction methods", 1990. Spine and chest divide the trunk where canonical joints lie.
"""


IN_SHOES = (1.0 - TOP_OF_HEAD - ANTHROPOMETRIC["left_ankle"][2]) / (1.0 - TOP_OF_HEAD - ANKLE_HEIGHT)
"""Height from the sole, as in calibrations, relative to that without shoes, as people know it; the part between
ankles and head is the same."""


def anthropometric_positions(height_m: float) -> NDArray[np.float64]:
    """Return the joints of an average person in a T-pose on the stage [m], shape (21, 3)."""
    out = np.zeros((JOINT_COUNT, 3))
    for name, position in ANTHROPOMETRIC.items():
        out[INDEX[name]] = position
        if name.startswith("left_"):
            out[MIRROR[INDEX[name]]] = np.array(position) * [-1.0, 1.0, 1.0]
    return out * height_m

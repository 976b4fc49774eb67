"""Trunk, arms, legs and shoes as one implicit solid, in the T-pose."""

import numpy as np
from numpy.typing import NDArray

from studio.simulator.body.field import Solid
from studio.simulator.body.frame import SIDES, Frame

Array = NDArray[np.float64]
_ARM, _LEG = (1, 2), (3, 4)  # groups, left and right
_GAP_M = 0.004
"""Gap between the thighs."""


def trunk(frame: Frame) -> Solid:
    """Return the body from neck to toes without its hands."""
    solid = Solid(blend_m=0.045 * frame.scale)
    _torso(solid, frame)
    for i, (side, sign) in enumerate(SIDES):
        _arm(solid, frame, side, _ARM[i])
        _leg(solid, frame, side, sign, _LEG[i])
    return solid


def _torso(solid: Solid, frame: Frame) -> None:
    who, s, w = frame.performer, frame.scale, frame.breadth
    g = who.girth
    hip, shoulder, neck = frame.middle("hip"), frame.middle("shoulder"), frame.joint("neck")
    height = shoulder[2] - hip[2]

    def at(x: float, y: float, share: float) -> Array:
        """A point on the line from hips to shoulders, offset by x, y [m at scale 1]."""
        line = hip + share * (shoulder - hip)
        return np.array([x * w, line[1] + y * s, line[2]])

    solid.ball(at(0, 0.022, 0.03), (0.166 * w * g, 0.112 * s * g, 0.105 * s))
    solid.ball(at(0, 0.012, 0.24), (0.148 * w * g, 0.100 * s * g, 0.115 * s), blend_m=0.06 * s)
    solid.ball(at(0, 0.010, 0.44), (0.137 * w * g, 0.094 * s * g, 0.115 * s), blend_m=0.06 * s)
    solid.ball(at(0, 0.004, 0.66), (0.148 * w * g, 0.108 * s * g, 0.120 * s), blend_m=0.06 * s)
    solid.ball(at(0, 0.006, 0.86), (0.150 * w * g, 0.100 * s * g, 0.085 * s), blend_m=0.06 * s)
    belly = who.belly
    solid.ball(
        at(0, -0.050 - 0.02 * (belly - 1), 0.28),
        (0.118 * w * g * belly, 0.062 * s * g * belly**1.5, 0.125 * height / 0.48),
        blend_m=0.05 * s,
    )
    for _, sign in SIDES:
        solid.ball(
            at(sign * 0.078, 0.068, -0.05), (0.083 * w * g, 0.070 * s * g, 0.088 * s), blend_m=0.04 * s
        )
        solid.ball(
            at(sign * 0.078, -0.062, 0.72), (0.072 * w * g, 0.044 * s * g, 0.058 * s), blend_m=0.04 * s
        )
        solid.ball(at(sign * 0.080, 0.070, 0.78), (0.070 * w * g, 0.040 * s * g, 0.085 * s), blend_m=0.04 * s)
        if who.bust > 0:
            r = 0.062 * s * who.bust**0.5
            solid.ball(at(sign * 0.080, -0.085 - 0.03 * who.bust, 0.66), (r, r, r), blend_m=0.03 * s)
        top = frame.joint(f"{'left' if sign > 0 else 'right'}_shoulder")
        root = np.array([sign * 0.045 * s, neck[1] + 0.01 * s, neck[2] - 0.005 * s])
        solid.cone(
            root,
            top + np.array([-sign * 0.02 * s, 0, 0.008 * s]),
            (0.046 * s * g, 0.048 * s * g),
            blend_m=0.05 * s,
        )
    solid.cone(
        neck - np.array([0, 0, 0.04 * s]),
        frame.joint("head"),
        (0.064 * s * g, 0.058 * s * g),
        blend_m=0.05 * s,
    )


def _arm(solid: Solid, frame: Frame, side: str, group: int) -> None:
    s, g = frame.scale, frame.performer.girth
    shoulder, elbow, wrist = (frame.joint(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist"))

    def upper(share: float) -> Array:
        return shoulder + share * (elbow - shoulder)

    def fore(share: float) -> Array:
        return elbow + share * (wrist - elbow)

    kind = {"group": group, "blend_m": 0.025 * s}
    solid.cone(upper(-0.02), upper(0.16), (0.060 * s * g, 0.052 * s * g), **kind)
    solid.cone(upper(0.1), upper(0.95), (0.051 * s * g, 0.040 * s * g), **kind)
    solid.ball(upper(0.5) + np.array([0, -0.014 * s, 0]), (0.085 * s, 0.036 * s * g, 0.040 * s * g), **kind)
    solid.cone(elbow, fore(0.25), (0.040 * s * g, 0.0435 * s * g), **kind)
    solid.cone(fore(0.25), fore(0.92), (0.0435 * s * g, 0.029 * s * g), flat=(1, 1, 0.93), **kind)
    solid.cone(fore(0.85), fore(1.0), (0.029 * s, 0.026 * s), flat=(1, 1.1, 0.8), **kind)


def _leg(solid: Solid, frame: Frame, side: str, sign: float, group: int) -> None:
    s, g = frame.scale, frame.performer.girth
    hip, knee, ankle, toe = (frame.joint(f"{side}_{joint}") for joint in ("hip", "knee", "ankle", "toe"))

    def thigh(share: float) -> Array:
        return hip + share * (knee - hip)

    def shin(share: float) -> Array:
        return knee + share * (ankle - knee)

    kind = {"group": group, "blend_m": 0.03 * s}
    solid.cone(thigh(0.06) + np.array([0, 0.012 * s, 0]), thigh(0.45), (0.089 * s * g, 0.077 * s * g), **kind)
    solid.cone(
        thigh(0.45) + np.array([0, -0.004 * s, 0]), thigh(0.97), (0.077 * s * g, 0.056 * s * g), **kind
    )
    solid.cone(knee + np.array([0, -0.008 * s, 0]), shin(0.1), (0.053 * s * g, 0.051 * s * g), **kind)
    solid.cone(shin(0.08), shin(0.9), (0.049 * s * g, 0.037 * s * g), **kind)
    solid.ball(shin(0.3) + np.array([0, 0.018 * s, 0]), (0.050 * s * g, 0.046 * s * g, 0.115 * s), **kind)
    solid.cone(shin(0.85), ankle, (0.037 * s * g, 0.039 * s * g), **kind)
    heel = np.array([ankle[0], ankle[1] + 0.030 * s, 0.036 * s])
    ball = np.array([toe[0], toe[1], 0.030 * s])
    tip = toe + np.array([0, -0.062 * s, 0])
    solid.cone(ankle - np.array([0, 0, 0.01 * s]), heel, (0.038 * s, 0.037 * s), **kind)
    solid.cone(heel, ball, (0.037 * s, 0.040 * s), flat=(1.1, 1, 0.95), **kind)
    solid.cone(ankle - np.array([0, 0.02 * s, 0.012 * s]), ball, (0.036 * s, 0.028 * s), **kind)
    solid.cone(
        ball, np.array([tip[0], tip[1], 0.02 * s]), (0.040 * s, 0.026 * s), flat=(1.15, 1, 0.9), **kind
    )
    solid.cut(group, (sign, 0.0, 0.0), _GAP_M / 2)
    solid.cut(group, (0.0, 0.0, 1.0), 0.0)

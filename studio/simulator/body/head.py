"""Head with nose and ears, and the hair, as implicit solids in the T-pose, facing -y."""

import numpy as np

from studio.simulator.body.field import Solid
from studio.simulator.body.frame import SIDES, Frame

TOP_M = 0.180
"""Height of an adult's head above the base of the skull."""


def head_scale(frame: Frame) -> float:
    """Return the head's size relative to an adult's; heads vary less than bodies."""
    return float(0.35 + 0.65 * frame.scale) * (1 + 0.6 * (frame.performer.head - 1))


def head(frame: Frame) -> Solid:
    """Return skull, face, ears and neck."""
    h, base, s = head_scale(frame), frame.joint("head"), frame.scale
    solid = Solid(blend_m=0.006 * h)

    def at(x: float, y: float, z: float) -> np.ndarray:
        return base + h * np.array([x, y, z])

    solid.ball(at(0, -0.008, 0.092), (0.075 * h, 0.094 * h, 0.088 * h), blend_m=0.02 * h)
    solid.ball(at(0, -0.042, 0.040), (0.064 * h, 0.066 * h, 0.085 * h), blend_m=0.03 * h)
    solid.ball(at(0, -0.078, -0.022), (0.030 * h, 0.026 * h, 0.024 * h), blend_m=0.03 * h)
    solid.ball(at(0, -0.086, 0.092), (0.050 * h, 0.018 * h, 0.014 * h), blend_m=0.02 * h)
    solid.ball(at(0, -0.104, 0.008), (0.026 * h, 0.010 * h, 0.016 * h), blend_m=0.012 * h)
    solid.cone(at(0, -0.104, 0.074), at(0, -0.126, 0.038), (0.009 * h, 0.0125 * h), blend_m=0.012 * h)
    solid.cone(
        at(-0.013, -0.112, 0.034), at(0.013, -0.112, 0.034), (0.0095 * h, 0.0095 * h), blend_m=0.008 * h
    )
    for group, (_, sign) in enumerate(SIDES, start=1):
        solid.ball(at(sign * 0.081, 0.004, 0.058), (0.010 * h, 0.019 * h, 0.033 * h), group=group)
    neck = frame.joint("neck")
    r = 0.057 * s * frame.performer.girth**0.5
    solid.cone(
        neck - np.array([0, 0, 0.03 * s]),
        base + np.array([0, -0.012 * h, 0.03 * h]),
        (1.05 * r, 0.98 * r),
        blend_m=0.02 * h,
    )
    return solid


def hair(frame: Frame) -> Solid | None:
    """Return the hair over skull and neck, or None for a bald head."""
    kind = frame.performer.hair
    if kind == "none":
        return None
    h, base = head_scale(frame), frame.joint("head")
    solid = Solid()

    def at(x: float, y: float, z: float) -> np.ndarray:
        return base + h * np.array([x, y, z])

    thick = {"short": 0.007, "bob": 0.016, "tail": 0.009}[kind]
    solid.ball(at(0, 0.006, 0.100), ((0.075 + thick) * h, (0.087 + thick) * h, (0.084 + thick) * h))
    if kind == "bob":
        for _, sign in SIDES:
            solid.cone(at(sign * 0.070, 0.010, 0.07), at(sign * 0.072, 0.018, -0.03), (0.026 * h, 0.018 * h))
        solid.cone(at(0, 0.072, 0.08), at(0, 0.062, -0.03), (0.034 * h, 0.028 * h), flat=(2, 1, 1))
    elif kind == "tail":
        solid.ball(at(0, 0.105, 0.13), (0.028 * h, 0.030 * h, 0.028 * h), blend_m=0.01)
        solid.cone(at(0, 0.125, 0.12), at(0, 0.120, -0.02), (0.022 * h, 0.012 * h), blend_m=0.01)
    else:
        solid.ball(at(0, 0.050, 0.06), ((0.066 + thick) * h, (0.044 + thick) * h, 0.062 * h))
    solid.cut(0, (0.0, 0.80, 0.60), 0.80 * (base[1] - 0.072 * h) + 0.60 * (base[2] + 0.108 * h))
    return solid

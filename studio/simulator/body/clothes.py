"""Loose clothes: layers that stand off the body, hang, and have folds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.simulator.body.field import Solid
from studio.simulator.body.frame import Frame

Array = NDArray[np.float64]
_SPAN = 1.7
"""Blend factor of cloth, so that it spans hollows."""


@dataclass(frozen=True)
class Garment:
    """A piece of clothing in the T-pose.

    Attributes:
        field: solid at points [m], shape (n, 3) -> (n,), negative inside, closed at the hems.
        looseness: largest movement of the cloth at points [m], shape (n, 3) -> (n,).
    """

    field: Callable[[Array], Array]
    looseness: Callable[[Array], Array]


def _folds(points: Array, seed: int, length_m: float) -> Array:
    """Sum of six plane waves in random directions, about -1..1, shape (n,)."""
    rng = np.random.default_rng(seed)
    total = np.zeros(len(points))
    for _ in range(6):
        way = rng.normal(size=3) * [1.0, 1.0, 0.7]
        way *= rng.uniform(0.7, 1.5) / np.linalg.norm(way)
        total += np.sin(2 * np.pi * points @ way / length_m + rng.uniform(0, 2 * np.pi))
    return total / 2.4


def shirt(frame: Frame, body: Solid) -> Garment:
    """Return a shirt with sleeves over the trunk."""
    who, s = frame.performer, frame.scale
    loose = who.looseness_m * s**0.5
    neck, hip = frame.joint("neck"), frame.middle("hip")[2]
    shoulder, elbow, wrist = (frame.joint(f"left_{j}")[0] for j in ("shoulder", "elbow", "wrist"))
    end = float(np.interp(who.sleeve, [0, 1, 2], [shoulder, elbow, wrist]))
    hem = hip - who.skirt_m * s

    def looseness(points: Array) -> Array:
        x, z = np.abs(points[:, 0]), points[:, 2]
        sleeve = np.interp(x, [shoulder, elbow, wrist], [0.45, 1.0, 0.75])
        body_share = np.interp(z, [hem, hip + 0.12 * s, neck[2] - 0.12 * s, neck[2]], [1.5, 1.2, 0.5, 0.25])
        return loose * np.where(x > shoulder, sleeve, body_share)

    def field(points: Array) -> Array:
        x, z = np.abs(points[:, 0]), points[:, 2]
        off = looseness(points)
        value = body.at(points, blend_factor=_SPAN) - off
        value -= 0.45 * off * _folds(points, who.seed, 0.17 * s)
        collar = z - 0.8 * (points[:, 1] - neck[1]) - (neck[2] + 0.012 * s)
        return np.max([value, collar, hem - z, x - end], axis=0)

    return Garment(field, looseness)


def trousers(frame: Frame, body: Solid) -> Garment:
    """Return trousers from the waist to knee or ankle."""
    who, s = frame.performer, frame.scale
    loose = who.looseness_m * s**0.5
    hip, knee, ankle = (frame.middle(joint)[2] for joint in ("hip", "knee", "ankle"))
    waist, end = hip + 0.10 * s, float(np.interp(who.trouser, [1, 2], [knee, ankle]))
    arm = frame.joint("left_shoulder")[0] + 0.12 * s

    def looseness(points: Array) -> Array:
        share = np.interp(points[:, 2], [ankle, knee, hip - 0.1 * s, hip + 0.1 * s], [1.5, 1.1, 0.6, 0.35])
        return loose * share

    def field(points: Array) -> Array:
        x, z = np.abs(points[:, 0]), points[:, 2]
        off = looseness(points)
        value = body.at(points, blend_factor=1.2) - off
        value -= 0.45 * off * _folds(points, who.seed + 1, 0.19 * s)
        value = np.maximum(value, np.where(z < hip - 0.12 * s, 0.004 - x, -1.0))
        return np.max([value, z - waist, end - z, x - arm], axis=0)

    return Garment(field, looseness)

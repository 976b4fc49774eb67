"""Movements added to the performer's motion: turning the head, opening and closing the hands."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
_CHANGE_S = 0.25
"""Time in which a hand opens or closes."""


def head_turns(times_s: Array, rng: np.random.Generator) -> Array:
    """Return small turns of the head, shape (F, 3, 3), in the body's T-pose axes.

    A glance turns to one side by up to 45 degrees, up or down by up to 20, and lasts one to three seconds.
    """
    angles = np.zeros((len(times_s), 3))
    now = 1.0
    while now < times_s[-1]:
        length = rng.uniform(1.0, 3.0)
        target = np.radians([rng.uniform(-20, 15), rng.uniform(-8, 8), rng.uniform(-45, 45)])
        share = _smooth((times_s - now) / 0.4) * (1 - _smooth((times_s - now - length) / 0.4))
        angles += share[:, None] * target
        now += length + rng.uniform(0.3, 2.0)
    return Rotation.from_euler("xyz", angles).as_matrix()


def hand_changes(times_s: Array, rng: np.random.Generator) -> Array:
    """Return the openness of the hands over time, 1 = open, 0 = fist, shape (F, 2); each state lasts 1 to 3
    seconds."""
    out = np.ones((len(times_s), 2))
    for hand in range(2):
        now, closed = rng.uniform(0.5, 2.0), False
        while now < times_s[-1]:
            way = _smooth((times_s - now) / _CHANGE_S)
            out[:, hand] = np.where(way > 0, way if closed else 1 - way, out[:, hand])
            closed = not closed
            now += rng.uniform(1.0, 3.0)
    return out


def _smooth(share: Array) -> Array:
    t = np.clip(share, 0.0, 1.0)
    return t * t * (3 - 2 * t)

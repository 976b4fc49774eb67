"""Relax pose: the solved pose blended with the resting stance (Ménard 2014, 5.3: 10 % relaxed)."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import Humanoid


def relaxed(humanoid: Humanoid, q: NDArray[np.float64], weight: float) -> NDArray[np.float64]:
    """Return the configuration with each hinge moved `weight` (0..1) of the way to the middle of its range.

    The hips keep their place.
    """
    out = q.copy()
    out[7:] = (1.0 - weight) * q[7:] + weight * humanoid.range_rad.mean(axis=1)
    return out

"""Uncertainty of each joint of a finished take: the radius of the 90 % ball.

As live (`solve.uncertainty`), the squared radius is a sum: the device's offset from the anatomical centre, the rest
of the cameras' noise (cameras without weight do not count, and a joint without any camera is hardly known), the
distance to the cameras' weighted joint, and the rounding of sharp motion by smoothing.

The covariance of the body given all cameras (the inverse of the normal matrix through the joints' Jacobians) was
tried and is too small: offsets do not average out over a body whose bones were measured with them. The coefficients
began as quantile regression at 0.9 (Koenker, Bassett, Econometrica 1978) on jumps_2 and ballet_4, the offset held at
its size. Accelerations then got more weight and misfits less, so that quiet takes have smaller balls.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.solve.uncertainty import BALL_90, OFFSET_M

OFFSET_LEFT = 0.93
"""Share of the devices' offsets that differs between joints. The common part of a body's 15 joints moves it as a
whole, by six numbers of 45.
"""

NOISE = 0.03
"""Squared radius per variance of the cameras' pooled noise."""

UNSEEN_M = 0.15
"""Radius of a joint without any camera."""

MEMORY_S = 0.1
"""Standard deviation of the Gaussian over which measurements are averaged."""

MISFIT = 1.0
"""Radius per metre between the joint and the cameras' joint."""

ROUNDING_S2 = 2.2e-3
"""Radius per m/s2 of acceleration [s2]."""

ACCELERATION_S = 0.017
"""Averaging time of accelerations."""


def squared_radii(
    sites: NDArray[np.float64], weight: NDArray[np.float64], pull: NDArray[np.float64], dt: float
) -> NDArray[np.float64]:
    """Return squared radii of the 90 % balls of canonical joints [m2], shape (frame_count, 21).

    Args:
        sites: canonical joints [m], shape (frame_count, 21, 3).
        weight: information of the cameras on each joint in a frame [1/m2], shape (frame_count, 21, 3, 3).
        pull: information times the difference to the cameras' joints [1/m], shape (frame_count, 21, 3).
        dt: time between frames [s].
    """
    told = _averaged(np.trace(weight, axis1=2, axis2=3) / 3.0, MEMORY_S / dt)
    away = _averaged(pull, MEMORY_S / dt) / np.maximum(told, 1.0)[..., None]
    squared = (OFFSET_LEFT * BALL_90 * OFFSET_M) ** 2 + 1.0 / (told / NOISE + UNSEEN_M**-2)
    squared += MISFIT**2 * np.einsum("tja,tja->tj", away, away)
    if len(sites) > 2:
        acceleration = np.gradient(np.gradient(sites, dt, axis=0), dt, axis=0)
        acceleration = _averaged(acceleration, ACCELERATION_S / dt)
        squared += ROUNDING_S2**2 * np.einsum("tja,tja->tj", acceleration, acceleration)
    return squared


def _averaged(values: NDArray[np.float64], frames: float) -> NDArray[np.float64]:
    return gaussian_filter1d(values, frames, axis=0, mode="nearest", truncate=3.0)

"""The first rigid transform between two cameras, from points that do not depend on left and right labels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import fit_rigid, transform_points
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR

_CENTRE = [INDEX[name] for name in CANONICAL if not name.startswith("right_")]
_ITERATIONS = 15


@dataclass(frozen=True)
class RigidFit:
    """A robust rigid fit: transform, weights (0..1) and residuals [m] of its points, shape (point_count,)."""

    T: NDArray[np.float64]
    weights: NDArray[np.float64]
    residuals_m: NDArray[np.float64]

    @property
    def median_m(self) -> float:
        return float(np.median(self.residuals_m))


def middle_points(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the trunk's joints and the middles of left and right joints, shape (..., 13, 3).

    They do not change if the camera swaps left and right.
    """
    return ((positions + positions[..., MIRROR, :]) / 2)[..., _CENTRE, :]


def fit_robust(
    source: NDArray[np.float64], target: NDArray[np.float64], weights: NDArray[np.float64] | None = None
) -> RigidFit:
    """Return the rigid transform from `source` to `target`, with robust weights against outliers.

    Args:
        source, target: matching points [m], shape (point_count, 3), finite.
        weights: of the points, shape (point_count,); equal where None.

    Source: iteratively reweighted least squares with the weights of Geman and McClure, "Statistical methods
    for tomographic image reconstruction", 1987, as in Zhang, "Parameter estimation techniques", 1997,
    section 9.4; the scale is the median absolute deviation.
    """
    base = np.ones(len(source)) if weights is None else weights
    robust = np.ones(len(source))
    T = fit_rigid(source, target, base)
    for _ in range(_ITERATIONS):
        residuals = np.linalg.norm(transform_points(T, source) - target, axis=1)
        scale = max(2.0 * float(np.median(residuals)), 1e-4)
        robust = (1.0 + (residuals / scale) ** 2) ** -2
        T = fit_rigid(source, target, base * robust)
    residuals = np.linalg.norm(transform_points(T, source) - target, axis=1)
    return RigidFit(T, robust, residuals)


def mirrored(source: NDArray[np.float64], target: NDArray[np.float64], fit: RigidFit) -> bool:
    """Whether a reflection fits the points far better than the rigid transform: a camera in mirror mode."""
    flipped = fit_robust(source * [-1.0, 1.0, 1.0], target)
    return flipped.median_m < 0.6 * fit.median_m


def spread_m(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviations [m] of points along their principal axes, largest first, shape (3,)."""
    if len(points) < 4:
        return np.zeros(3)
    return np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points.T))[::-1], 0.0))

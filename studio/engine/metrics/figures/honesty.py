"""Calibration of a solve's uncertainty: its own 90 % balls against the actual errors.

Source: coverage and sharpness as in Gneiting, Balabdaoui, Raftery, "Probabilistic forecasts, calibration and
sharpness", J. R. Statist. Soc. B 2007: balls must contain the share that they claim, and be no larger than needed.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.reference.matching import Matched


def uncertainty_coverage(matched: Matched) -> float | None:
    """Share of the true positions inside the solve's 90 % balls, over measured joints and frames.

    The right value is 0.9. None where no radius is known. The solve is aligned first, as for every figure.
    """
    radius, error = _radii_and_errors(matched)
    return float((error <= radius).mean()) if len(error) else None


def uncertainty_median_ratio(matched: Matched) -> float | None:
    """Median radius of the balls divided by the median error; None where unknown or without an error.

    Normal errors of one standard deviation give 1.63; uncertainty about the size of errors gives more.
    """
    radius, error = _radii_and_errors(matched)
    median = float(np.median(error)) if len(error) else 0.0
    return float(np.median(radius)) / median if median > 0 else None


def _radii_and_errors(matched: Matched) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radii and errors [mm] where both are known, flat."""
    solve, reference = matched.pick(matched.joints)
    error = np.linalg.norm(solve - reference, axis=2) * 1e3
    radius = matched.radius_mm[:, matched.columns(matched.joints)]
    known = np.isfinite(error) & np.isfinite(radius)
    return radius[known], error[known]

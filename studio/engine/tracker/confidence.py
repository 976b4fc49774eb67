"""How far each joint may be off, and the confidence that says so.

Three things make a joint unsure: the covariance of the fit (few or no points, whose last sight is long ago), points
and free space that the limb does not explain, and the body model's own error. Squares are added.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import BODY_JOINTS
from studio.engine.joints import CANONICAL
from studio.engine.tracker.body import CANONICAL_BODIES, part_of
from studio.engine.tracker.chain import Chain, rows_of

Array = NDArray[np.float64]

MODEL_ERROR_M = 0.025
"""A joint of a body that fits well is off by about this [m]."""
_CONFIDENCE_M = 0.125
"""Confidence falls to 1/e where a joint may be off by this [m]."""
_COST_GAIN_M = 0.14
"""A limb that leaves 1 m2 unexplained may be off by about this [m] at its joints, more at its end.

Chosen, as the other two, on simulated recordings of performers that reported figures are not measured on."""

_PART_OF_JOINT = np.array([part_of(BODY_JOINTS[body]) for body in CANONICAL_BODIES])
_OUTNESS = {
    "shoulder": 1.0,
    "hip": 1.0,
    "elbow": 1.0,
    "knee": 1.0,
    "wrist": 1.6,
    "ankle": 1.2,
    "hand": 2.0,
    "toe": 1.5,
}
_OUTNESS_OF_JOINT = np.array([_OUTNESS.get(name.split("_")[-1], 0.0) for name in CANONICAL])


def expected_errors(
    chain: Chain, places: Array, axes: Array, joints: Array, covariance: Array, costs_m2: Array
) -> Array:
    """Return how far each canonical joint may be off [m], shape (21,).

    Args:
        places, axes: of the chain as it stands.
        joints: canonical joints [m], shape (21, 3).
        covariance: of a tangent step, shape (6 + dof_count, 6 + dof_count).
        costs_m2: what each part leaves unexplained [m2], shape (5,).
    """
    jacobian = np.zeros((3 * len(joints), len(covariance)))
    directions = np.tile(np.eye(3), (len(joints), 1))
    rows_of(
        chain,
        places,
        axes,
        np.repeat(CANONICAL_BODIES, 3),
        np.repeat(joints, 3, axis=0),
        directions,
        jacobian,
    )
    spread = ((jacobian @ covariance) * jacobian).sum(axis=1).reshape(-1, 3).sum(axis=1)
    cost = _OUTNESS_OF_JOINT * _COST_GAIN_M * np.sqrt(np.maximum(costs_m2[_PART_OF_JOINT], 0.0))
    return np.sqrt(MODEL_ERROR_M**2 + spread + cost**2)


def confidence_of(errors_m: Array) -> Array:
    """Return the confidence of joints that may be so far off [m], 0..1, same shape."""
    return np.exp(-((errors_m / _CONFIDENCE_M) ** 2))

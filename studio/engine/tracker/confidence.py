"""How far each joint may be off, and the confidence that says so.

What makes a joint of a limb unsure is weighed by a logistic regression: the covariance of the fit, whether the joint
lies behind what the cameras see there or where they see past it, how many points lie on its bone and on the one
before, how well they fit, points about it that nothing explains, and what the limb leaves or lately left
unexplained. The slopes are the mean of two fits on simulated performers for tuning and random bodies like them, seen
by one, two and three cameras: one in motions that reported figures are not measured on, one with tuning performers in
wide clothes before one camera, who begin in profile (the motion 14_08, which `bars` measures with other performers).
The threshold comes from `tests/engine/tracker/fit_confidence.py`, whose runs were not among them; it fits slopes as
well, and says why those are not in use.
The trunk's joints have the covariance and the model's own error.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import BODY_JOINTS
from studio.engine.joints import CANONICAL, INDEX
from studio.engine.tracker.body import CANONICAL_BODIES, PARTS
from studio.engine.tracker.chain import Chain, rows_of

Array = NDArray[np.float64]

MODEL_ERROR_M = 0.025
"""A joint of a body that fits well is off by about this [m]."""
_CONFIDENCE_M = 0.125
"""Confidence falls to 1/e where a joint may be off by this [m]."""
_UNSURE_M = 0.067
"""Where the log-odds are 0 a joint may be off by this [m]: a confidence of 0.75."""
_ERROR_PER_LOG_ODDS = 0.3
_MOST_M = 0.4
_CAP_M, _ABOUT_M = 0.15, 0.20
_HIDDEN_M = (-0.4, 0.6)

KINDS: tuple[str, ...] = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
EVIDENCE: tuple[str, ...] = (
    "1", "log of the variance [m2]", "behind what is seen [m]", "its square", "log of points on its bone",
    "log of points on the bone before", "their mean distance [m]", "unexplained about it [m]",
    "unexplained by the limb [m]", "lately [m]",
)  # fmt: skip
"""What `_WEIGHTS` belong to, from left to right; square roots of what is in square metres."""

_WEIGHTS: Array = np.array([
    [7.26, 0.99, -14.52, 28.26, -0.84, -1.01, 117.34, 8.54, 5.74, 2.27],
    [7.76, 0.96, -3.10, 8.47, -0.51, -1.68, 184.61, 7.95, 3.72, 2.64],
    [5.98, 0.87, -1.21, 8.75, -0.66, -1.29, 179.94, 3.15, 4.57, 2.15],
    [4.03, 0.94, 1.13, 14.94, -1.67, 0.60, 169.17, 9.36, 4.53, 3.49],
    [7.59, 1.22, -6.77, 15.33, 0.03, -1.18, 153.86, 5.43, 2.83, 3.05],
    [8.05, 1.12, -3.65, 8.97, -0.08, -1.45, 211.62, 0.38, 2.85, 3.32],
])  # fmt: skip
"""By kind of joint, the log-odds of its being off by more than 6 cm, less what leaves 8 % of those within 3 cm above
0 in the runs of `fit_confidence` that are not disturbed."""

LIMB_JOINTS: NDArray[np.int64] = np.array([INDEX[f"{s}_{kind}"] for s in ("left", "right") for kind in KINDS])
"""Canonical joints that have weights, shape (12,)."""
_KIND = np.tile(np.arange(len(KINDS)), 2)
_LIMB = np.array([
    PARTS.index(f"{side}_{limb}") for side in ("left", "right") for limb in ("arm",) * 3 + ("leg",) * 3
])  # fmt: skip
_BEYOND = {"hand": "wrist", "toe": "ankle"}
_BEYOND_SHARE = 1.25
"""Hands and toes are off by so much more than wrists and ankles."""


class Seen(NamedTuple):
    """What one instant's images say about a fitted body.

    Attributes:
        places: measured points [m], shape (point_count, 3). bodies: which each lies on, distance: how far from it
            [m], both of shape (point_count,).
        behind_m: how far each canonical joint lies behind what the cameras see there, shape (21,).
        costs_m2, lately_m2: what each part leaves unexplained, and left lately, shape (5,).
    """

    places: Array
    bodies: NDArray[np.int64]
    distance: Array
    behind_m: Array
    costs_m2: Array
    lately_m2: Array


def variances(chain: Chain, places: Array, axes: Array, joints: Array, covariance: Array) -> Array:
    """Return the variance of each canonical joint's place [m2], shape (21,).

    Args:
        places, axes: of the chain as it stands.
        joints: canonical joints [m], shape (21, 3).
        covariance: of a tangent step, shape (6 + dof_count, 6 + dof_count).
    """
    jacobian = np.zeros((3 * len(joints), len(covariance)))
    directions = np.tile(np.eye(3), (len(joints), 1))
    bodies = np.repeat(CANONICAL_BODIES, 3)
    rows_of(chain, places, axes, bodies, np.repeat(joints, 3, axis=0), directions, jacobian)
    return ((jacobian @ covariance) * jacobian).sum(axis=1).reshape(-1, 3).sum(axis=1)


def evidence(chain: Chain, joints: Array, variance: Array, seen: Seen) -> Array:
    """Return what is weighed for every joint of `LIMB_JOINTS`, shape (12, len(EVIDENCE))."""
    capped = np.minimum(seen.distance, _CAP_M)
    count = np.bincount(seen.bodies, minlength=len(BODY_JOINTS))
    mean = np.bincount(seen.bodies, weights=capped, minlength=len(BODY_JOINTS)) / np.maximum(count, 1)
    away = ((seen.places[:, None] - joints[LIMB_JOINTS]) ** 2).sum(axis=2)
    about = capped**2 @ (away < _ABOUT_M**2)
    body = CANONICAL_BODIES[LIMB_JOINTS]
    before = chain.parents[body]
    behind = np.clip(seen.behind_m[LIMB_JOINTS], *_HIDDEN_M)
    costs, lately = (np.clip(some[_LIMB], 0.0, 2.0) for some in (seen.costs_m2, seen.lately_m2))
    return np.stack([
        np.ones(len(body)), np.log(variance[LIMB_JOINTS] + 1e-6), behind, behind**2, np.log1p(count[body]),
        np.log1p(count[before]), mean[before], np.sqrt(about), np.sqrt(costs), np.sqrt(lately),
    ], axis=1)  # fmt: skip


def expected_errors(chain: Chain, joints: Array, variance: Array, seen: Seen) -> Array:
    """Return how far each canonical joint may be off [m], shape (21,)."""
    errors = np.sqrt(MODEL_ERROR_M**2 + variance)
    log_odds = (_WEIGHTS[_KIND] * evidence(chain, joints, variance, seen)).sum(axis=1)
    limbs = _UNSURE_M * np.exp(_ERROR_PER_LOG_ODDS * np.minimum(log_odds, 20.0))
    errors[LIMB_JOINTS] = np.clip(limbs, MODEL_ERROR_M, _MOST_M)
    for index, name in enumerate(CANONICAL):
        side, _, joint = name.partition("_")
        if joint in _BEYOND:
            errors[index] = _BEYOND_SHARE * errors[INDEX[f"{side}_{_BEYOND[joint]}"]]
    return errors


def confidence_of(errors_m: Array) -> Array:
    """Return the confidence of joints that may be so far off [m], 0..1, same shape."""
    return np.exp(-((errors_m / _CONFIDENCE_M) ** 2))

"""Expected error of each joint, and its confidence.

For limbs, a logistic regression weighs the evidence: the covariance of the fit, the joint's depth behind the surface
that the cameras see (or whether they see past the joint), the number and distance of points on its bone and on the
bone before it, unexplained points near it, and the limb's present and recent residual. The slopes are the mean of two
fits on simulated tuning performers and random bodies like them, seen by one, two and three cameras. The first fit
uses motions on which no reported figures are measured. The second uses tuning performers in wide clothes in front of
one camera, who begin in profile (the motion 14_08, which `bars` measures with other performers).
The threshold comes from `fit_confidence` among the tests, whose runs were not used for the slopes; it also fits
slopes, and says why those are not used. The trunk's joints have the covariance's error and the model's own.

Three things set a lower bound on the error, whatever the regression says: missing readings on either side of a joint,
another pose found for the same images, and a limb whose other joints are unknown. The other pose is the one before
the restart of the body, or one that explains the first images nearly as well. Joints that the points do not determine
have a lower bound too; see `search.bones`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.model.joints import CANONICAL, INDEX
from studio.engine.seeing.fitting.chain import Chain, rows_of
from studio.engine.seeing.fitting.cones import CANONICAL_BODIES, PARTS

Array = NDArray[np.float64]

MODEL_ERROR_M = 0.025
"""Usual error of a joint of a body that fits well [m]."""
_CONFIDENCE_M = 0.125
"""Expected error at which confidence falls to 1/e [m]."""
_UNSURE_M = 0.067
"""Expected error at log-odds of 0 [m]: a confidence of 0.75."""
_ERROR_PER_LOG_ODDS = 0.3
_MOST_M = 0.4
_CAP_M, _ABOUT_M = 0.15, 0.20
_HIDDEN_M = (-0.4, 0.6)

_UNREAD_M, _HALF_UNREAD_M = 0.12, 0.10
"""Minimum expected error of a joint that lacks readings on both sides, and of one that lacks them on one side [m]."""
_CHAIN_SHARE = 0.7
"""Least expected error of a wrist or ankle relative to the mean of its limb's other joints."""

KINDS: tuple[str, ...] = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
EVIDENCE: tuple[str, ...] = (
    "1", "log of the variance [m2]", "behind what is seen [m]", "its square", "log of points on its bone",
    "log of points on the bone before", "their mean distance [m]", "unexplained about it [m]",
    "unexplained by the limb [m]", "lately [m]",
)  # fmt: skip
"""The columns of `_WEIGHTS`; square roots of evidence in square metres."""

_WEIGHTS: Array = np.array([
    [7.26, 0.99, -14.52, 28.26, -0.84, -1.01, 117.34, 8.54, 5.74, 2.27],
    [7.76, 0.96, -3.10, 8.47, -0.51, -1.68, 184.61, 7.95, 3.72, 2.64],
    [5.98, 0.87, -1.21, 8.75, -0.66, -1.29, 179.94, 3.15, 4.57, 2.15],
    [4.03, 0.94, 1.13, 14.94, -1.67, 0.60, 169.17, 9.36, 4.53, 3.49],
    [7.59, 1.22, -6.77, 15.33, 0.03, -1.18, 153.86, 5.43, 2.83, 3.05],
    [8.05, 1.12, -3.65, 8.97, -0.08, -1.45, 211.62, 0.38, 2.85, 3.32],
])  # fmt: skip
"""By kind of joint, the log-odds of an error above 6 cm, shifted so that 8 % of the joints within 3 cm are above
0 in the undisturbed runs of `fit_confidence`.
"""

LIMB_JOINTS: NDArray[np.int64] = np.array([INDEX[f"{s}_{kind}"] for s in ("left", "right") for kind in KINDS])
"""Canonical joints with weights, shape (12,)."""
_KIND = np.tile(np.arange(len(KINDS)), 2)
_LIMB = np.array([
    PARTS.index(f"{side}_{limb}") for side in ("left", "right") for limb in ("arm",) * 3 + ("leg",) * 3
])  # fmt: skip
_BEYOND = {"hand": "wrist", "toe": "ankle"}
_BEYOND_SHARE = 1.25
"""Errors of hands and toes relative to wrists and ankles."""


class BodyEvidence(NamedTuple):
    """Evidence on a fitted body from one instant's images.

    Attributes:
        places: measured points [m], shape (point_count, 3). bodies: the body of each, distance: from its surface
            [m], both of shape (point_count,).
        behind_m: depth of each canonical joint behind the seen surface, shape (21,).
        costs_m2, lately_m2: present and recent residual of each part, shape (5,).
        unread: whether each body of the chain lacks readings next to its joint, and at its far end, shape
            (body_count, 2); see `search.unread`.
    """

    places: Array
    bodies: NDArray[np.int64]
    distance: Array
    behind_m: Array
    costs_m2: Array
    lately_m2: Array
    unread: NDArray[np.bool_]


def variances(
    chain: Chain, places: Array, axes: Array, joints: Array, covariance: NDArray[np.floating]
) -> Array:
    """Return the variance of each canonical joint's position [m2], shape (21,).

    Args:
        places, axes: of the chain in its pose.
        joints: canonical joints [m], shape (21, 3).
        covariance: of a tangent step, shape (6 + dof_count, 6 + dof_count).
    """
    jacobian = np.zeros((3 * len(joints), len(covariance)))
    directions = np.tile(np.eye(3), (len(joints), 1))
    bodies = np.repeat(CANONICAL_BODIES, 3)
    rows_of(chain, places, axes, bodies, np.repeat(joints, 3, axis=0), directions, jacobian)
    return ((jacobian @ covariance) * jacobian).sum(axis=1).reshape(-1, 3).sum(axis=1)


def evidence(chain: Chain, joints: Array, variance: Array, seen: BodyEvidence) -> Array:
    """Return the evidence on every joint of `LIMB_JOINTS`, shape (12, len(EVIDENCE))."""
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


def expected_errors(chain: Chain, joints: Array, variance: Array, seen: BodyEvidence) -> Array:
    """Return the expected error of each canonical joint [m], shape (21,), from its own evidence; see `bounded`."""
    errors = np.sqrt(MODEL_ERROR_M**2 + variance)
    log_odds = (_WEIGHTS[_KIND] * evidence(chain, joints, variance, seen)).sum(axis=1)
    limbs = _UNSURE_M * np.exp(_ERROR_PER_LOG_ODDS * np.minimum(log_odds, 20.0))
    errors[LIMB_JOINTS] = np.clip(
        np.maximum(limbs, _unread_errors(chain, seen.unread)), MODEL_ERROR_M, _MOST_M
    )
    return errors


def _unread_errors(chain: Chain, unread: NDArray[np.bool_]) -> Array:
    """Return the least errors of the joints of `LIMB_JOINTS` due to missing readings [m], shape (12,).

    A joint lies between two bones and needs readings next to it on both. The trunk says little about shoulders and
    hips, which need readings along their own bone; hands and feet say little about wrists and ankles.
    """
    body = CANONICAL_BODIES[LIMB_JOINTS]
    near, far = unread[body].T
    before = unread[chain.parents[body], 1]
    one = np.choose(_KIND % 3, [near | far, near | before, before])
    both = np.choose(_KIND % 3, [near & far, near & before, before])
    return np.where(both, _UNREAD_M, np.where(one, _HALF_UNREAD_M, 0.0))


def bounded(errors_m: Array, jumped_m: Array) -> Array:
    """Return the expected errors of canonical joints [m], shape (21,), raised to their lower bounds.

    Args:
        errors_m: from each joint's own evidence.
        jumped_m: recent jump or possible error of each joint, shape (21,); see `search.jumps`.
    """
    errors = np.minimum(np.maximum(errors_m, jumped_m), _MOST_M)
    limbs = errors[LIMB_JOINTS].reshape(4, 3)
    limbs[:, 2] = np.maximum(limbs[:, 2], _CHAIN_SHARE * limbs[:, :2].mean(axis=1))
    errors[LIMB_JOINTS] = limbs.ravel()
    for index, name in enumerate(CANONICAL):
        side, _, joint = name.partition("_")
        if joint in _BEYOND:
            errors[index] = _BEYOND_SHARE * errors[INDEX[f"{side}_{_BEYOND[joint]}"]]
    return errors


def confidence_of(errors_m: Array) -> Array:
    """Return the confidence of joints with these expected errors [m], 0..1, same shape."""
    return np.exp(-((errors_m / _CONFIDENCE_M) ** 2))

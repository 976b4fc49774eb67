"""Joints that the points do not determine: other bones explain the points as well, or the trunk is at a twist limit.

A body can lie on its points and still be wrong: a folded arm explains the same points as an arm stretched towards
the camera, and a shin on the other leg explains no points of its own. If the trunk is at a twist limit, shoulders and
hips are drawn to different headings, and one of them is wrong.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.seeing.fitting.chain import Limits, Pose
from studio.engine.seeing.fitting.fit import (
    POINT_SHARE,
    POINT_SIGMA_M,
    REACH_M,
    BodyShape,
    Fit,
    Fitter,
    MeasuredPoints,
)

Array = NDArray[np.float64]

SURE = np.log(20.0)
"""Minimum log-likelihood that a bone must add to the body without it."""
_AT_LIMIT = 0.99
"""A hinge counts as at its limit from this share of the limit."""
_LIMBS = [(side, limb) for side in ("Left", "Right") for limb in ("arm", "leg")]
_BONES = {"arm": ("Arm", "ForeArm", "Hand"), "leg": ("UpLeg", "Leg", "Foot", "ToeBase")}
_UPPER, _LOWER, _NEXT = (
    np.array([BODY_JOINTS.index(f"{side}{_BONES[limb][k]}") for side, limb in _LIMBS]) for k in range(3)
)
_FROM_LOWER = np.array([
    BODY_JOINTS.index(f"{side}{bone}") for side, limb in _LIMBS for bone in _BONES[limb][1:]
])  # fmt: skip
_ARM = np.array([limb == "arm" for _, limb in _LIMBS])


class Untold(NamedTuple):
    """Flags of joints that the points do not determine, in the order of `confidence.LIMB_JOINTS`, shape (12,).

    Attributes:
        now: in doubt for these images only; a wrist is found again within one frame. lately: in doubt for some
            frames, because the body moves to its points step by step.
    """

    now: NDArray[np.bool_]
    lately: NDArray[np.bool_]


def untold(fitter: Fitter, figure: BodyShape, fit: Fit, points: MeasuredPoints) -> Untold:
    """Return the joints that the points do not determine.

    Points count if no other bone, even of the same limb, explains them as well. A wrist or ankle needs such points on
    the far half of its forearm or shin, and a hip on its thigh. Shoulder and elbow of an arm bent by more than a
    right angle need them on one of its bones.
    """
    places = fitter.place(figure, fit.pose)[0]
    upper_each = _added(fitter, figure, fit, points, _UPPER)
    lower_each = _added(fitter, figure, fit, points, _FROM_LOWER)
    upper, lower = (
        log_likelihoods(figure, fit, each)[bones]
        for each, bones in ((upper_each, _UPPER), (lower_each, _LOWER))
    )
    far = np.zeros(len(_LIMBS))
    for k, (first, last) in enumerate(zip(places[_LOWER], places[_NEXT], strict=True)):
        beyond = (points.places - 0.5 * (first + last)) @ (last - first) > 0.0
        far[k] = lower_each[beyond & (figure.surface.body[fit.cone] == _LOWER[k])].sum()
    middle = places[_LOWER]
    bent = np.einsum("ki,ki->k", middle - places[_UPPER], places[_NEXT] - middle) < 0.0
    folded = _ARM & bent & (upper < SURE) & (lower < SURE)
    root = np.where(_ARM, folded, upper < SURE) | twisted(fitter.limits, fit.pose)
    end = far < SURE
    now = np.stack([np.zeros_like(end), np.zeros_like(end), end & _ARM], axis=1)
    lately = np.stack([root, folded, end & ~_ARM], axis=1)
    return Untold(now.ravel(), lately.ravel())


def twisted(limits: Limits, pose: Pose) -> bool:
    """Whether the trunk is at the limit of its twist."""
    k = limits.names.index("Spine_twist")
    return not _AT_LIMIT * limits.low[k] < pose.angles[k] < _AT_LIMIT * limits.high[k]


def log_likelihoods(figure: BodyShape, fit: Fit, added: Array) -> Array:
    """Return the sum of `added` over the points of each body of the chain, shape (body_count,).

    `added`: log-likelihood that each point's bone adds, shape (point_count,); see `added_by`.
    """
    sums = np.bincount(figure.surface.body[fit.cone], weights=added, minlength=len(BODY_JOINTS))
    return np.asarray(sums, dtype=np.float64)


def added_by(own_m: Array, others_m: Array) -> Array:
    """Return the log-likelihood that points gain from their own bone; `own_m`, `others_m`: distances from it and the
    others [m]."""
    own, others = (np.minimum(some, REACH_M) ** 2 for some in (own_m, others_m))
    return POINT_SHARE / (2.0 * POINT_SIGMA_M**2) * (others - own)


def _added(
    fitter: Fitter, figure: BodyShape, fit: Fit, points: MeasuredPoints, bodies: NDArray[np.int64]
) -> Array:
    """Return the log-likelihood that each point's bone adds to the rest of its limb without `bodies` and to the other
    parts; 0 for points of other bones, shape (point_count,).
    """
    cones = np.isin(figure.surface.body, bodies)
    mine = cones[fit.cone]
    rest = figure.only(np.flatnonzero(~cones))
    each = np.arange(int(mine.sum())), figure.surface.part[fit.cone[mine]]
    others = fit.distance[mine]
    own = others[each]
    others[each] = fitter.match(rest, fit.pose, points.some(mine))[-1][each]
    out = np.zeros(len(mine))
    out[mine] = added_by(own, others.min(axis=1))
    return out

"""Front or back: the tracked body is compared with a fit of the body turned round in the same place.

A front-back flip explains the points almost as well and never corrects itself, because no step of a fit leads to
the other side. The residuals of the two fits show the flip: feet point forwards, knees and elbows bend one way,
the trunk lies before or behind its joints. One image is enough in most cases; several in a row are used. A head that
faces the wrong way is further evidence.

Most flips begin when the fitted body stays in profile while the person continues to turn. The head's direction is as
well measured from the side as from the front, so the body is restarted in that direction.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import CANONICAL, MIRROR
from studio.engine.seeing.fitting.chain import ROOT_DOFS, Pose, rows_of
from studio.engine.seeing.fitting.cones import CANONICAL_BODIES, performer_of
from studio.engine.seeing.fitting.fit import BodyShape, Fitter, MeasuredPoints, Prior
from studio.engine.seeing.images.silhouette import Silhouette
from studio.engine.seeing.search.limbs import LimbSearch
from studio.engine.seeing.search.start import cost_of, unexplained

Array = NDArray[np.float64]

_PLACE_SIGMA_M = 0.03
_STEPS = 6
_FITTED, _REACH_M = 4, 0.12
"""Fits of the body and of the body turned round: iterations, and distance at which a point's weight falls [m]."""
_LEGS_HEIGHT = 0.47
"""Share of the height below which points belong to the legs. They show front and back best and count twice."""
_USED = np.array([i for i, name in enumerate(CANONICAL) if not name.endswith(("toe", "hand"))])
"""Joints that stay in place in a turn: all but those that point forwards."""


def turned_round(fitter: Fitter, figure: BodyShape, pose: Pose, posture: Array) -> Pose:
    """Return the pose turned front to back: each joint is at the place of the other side's joint, as far as its
    limits allow.

    Args:
        posture: weight of the resting angles, shape (6 + dof_count,).
    """
    target = joints_of(fitter, figure, pose)[0][MIRROR][_USED]
    turned = Pose(pose.root, pose.rotation @ np.diag([-1.0, -1.0, 1.0]), fitter.limits.rest.copy())
    bodies = np.repeat(CANONICAL_BODIES[_USED], 3)
    directions = np.tile(np.eye(3), (len(_USED), 1))
    for _ in range(_STEPS):
        joints, places, axes = joints_of(fitter, figure, turned)
        rows = np.zeros((len(bodies), len(posture)))
        spots = np.repeat(joints[_USED], 3, axis=0)
        rows_of(fitter.chain, places, axes, bodies, spots, directions, rows)
        information = rows.T @ rows / _PLACE_SIGMA_M**2 + np.diag(posture + 1e-3)
        gradient = rows.T @ (target - joints[_USED]).ravel() / _PLACE_SIGMA_M**2
        gradient[ROOT_DOFS:] += posture[ROOT_DOFS:] * (fitter.limits.rest - turned.angles)
        turned = turned.moved(fitter.step(information, gradient, turned), fitter.limits)
    return turned


def both_sides(
    fitter: Fitter,
    search: LimbSearch,
    figure: BodyShape,
    prior: Prior,
    points: MeasuredPoints,
    silhouettes: tuple[Silhouette, ...],
) -> tuple[tuple[float, float], Pose]:
    """Fit the expected pose and the pose turned round; return both residuals [m2], and the latter pose."""
    low = points.places[:, 2] < _LEGS_HEIGHT * performer_of(figure.shape).height_m
    costs, settled = [], prior.pose
    for pose in (prior.pose, turned_round(fitter, figure, prior.pose, prior.posture)):
        loose = Prior(pose, np.ones(len(prior.posture)), prior.posture)
        fit = fitter.fit(figure, pose, points, silhouettes, loose, iterations=_FITTED, reach=_REACH_M)
        cost = cost_of(search, figure, fit.pose, fit.distance, points, silhouettes)
        costs.append(cost + unexplained(fit.distance[low]))
        settled = fit.pose
    return (costs[0], costs[1]), settled


def joints_of(fitter: Fitter, figure: BodyShape, pose: Pose) -> tuple[Array, Array, Array]:
    """Return canonical joints [m], shape (21, 3), bodies' places and hinges' axes of a pose."""
    places, rotations, axes, *_ = fitter.place(figure, pose)
    offsets = np.einsum("jab,jb->ja", rotations[CANONICAL_BODIES], figure.canonical_offsets)
    return places[CANONICAL_BODIES] + offsets, places, axes


def forwards(pose: Pose) -> Array:
    """Return the heading of a body, a horizontal unit vector, shape (2,)."""
    return -pose.rotation[:2, 1] / max(float(np.hypot(*pose.rotation[:2, 1])), 1e-9)


_SURELY = 0.7
"""Confidence of a head's direction from which a body with that heading is tried."""
_ASIDE = np.radians(30.0)
"""Angle between head and body beyond which either the head is turned aside, or the body lags behind a turn. From the
side, both headings explain the points well, so even a body that fits well is compared with one turned to the head.
"""
_DOUBTED, _SIDE = 0.65, np.radians(45.0)
"""Mean confidence below which headings on either side of the head's direction are tried, because heads turn on
shoulders; angle of these headings to it."""
_ASIDE_BETTER, _BETTER = 0.9, 0.8
"""Maximum residual of a body restarted in the head's direction, or to its side, relative to the tracked body's."""


def aside_of(face: Array, pose: Pose) -> float | None:
    """Return the angle from a body's heading to its head's direction [rad], None if that is uncertain;
    `face`: see `Heads.face`.
    """
    ahead = forwards(pose)
    angle = float(np.arctan2(ahead[0] * face[1] - ahead[1] * face[0], ahead @ face))
    return angle if np.hypot(*face) > _SURELY else None


_OFTEN, _SELDOM = 4, 30
"""Frames between two tests: if a front-back flip may have happened lately, and otherwise."""
_GLANCE = 2
"""Frames between two checks of the head's direction, if a front-back flip may have happened lately."""
_LATELY = 60
_PROFILE = 0.5
"""Cosine of the angle between heading and view below which a camera sees the body from the side."""
_KEPT = 0.9
"""Share of earlier tests that is kept."""
_MOST = 0.1
"""Largest weight of one test, and of all evidence for the tracked body, because one image may mislead."""
_AGAINST = -0.1
"""Agreement of head and body below which front and back are tested soon."""
_HEAD = 0.3
"""Weight of a head that certainly faces straight ahead."""
_TURNED = -0.25
"""Sum of log ratios below which the body is turned round."""


class FacingWatch:
    """Schedule and results of the tests for front-back flips."""

    def __init__(self) -> None:
        self._unsure = _LATELY
        self._since = 0
        self._said = 0.0
        self._side = 1.0

    @property
    def unsure(self) -> bool:
        """Whether a front-back flip may have happened lately."""
        return self._unsure > 0

    @property
    def glances(self) -> bool:
        """Whether to check in this frame if the head faces aside."""
        return self.unsure and self._since % _GLANCE == 0

    def to_try(self, face: Array, pose: Pose, sure: float) -> tuple[float, float] | None:
        """Return the turn of a restarted body [rad], and its maximum residual relative to the tracked body's; None if
        the head gives no reason.

        Args:
            face: see `Heads.face`.
            sure: mean confidence of the limbs.
        """
        aside = aside_of(face, pose)
        if aside is None:
            return None
        if abs(aside) > _ASIDE:
            return aside, _ASIDE_BETTER
        if sure < _DOUBTED:
            self._side = -self._side
            return aside + self._side * _SIDE, _BETTER
        return None

    def looks(self) -> bool:
        """Count a frame; return whether to measure the head's direction in it."""
        self._since += 1
        return self._since % _OFTEN == 0

    def due(self, pose: Pose, views: Array, head_ahead: float | None) -> bool:
        """Whether to test in this frame.

        Args:
            views: horizontal unit vectors from the cameras to the body, shape (camera_count, 2).
            head_ahead: see `told`; None if it was not measured.
        """
        self._unsure = _LATELY if np.abs(views @ forwards(pose)).max() < _PROFILE else self._unsure - 1
        if head_ahead is not None and head_ahead < _AGAINST:
            self._unsure = max(self._unsure, _OFTEN)
        if self._since < (_OFTEN if self._unsure > 0 else _SELDOM):
            return False
        self._since = 0
        return True

    def told(self, cost_m2: float, turned_m2: float, head_ahead: float) -> bool:
        """Add a test; return whether to turn the body round.

        Args:
            cost_m2, turned_m2: residuals of the body and of the body turned round [m2].
            head_ahead: agreement of head and body: 1 = they face the same way; -1 = opposite ways; 0 = unknown.
        """
        told = float(np.clip(np.log(turned_m2 / cost_m2), -_MOST, _MOST)) + _HEAD * head_ahead
        self._said = min(_KEPT * self._said + told, _MOST)
        if self._said > _TURNED:
            return False
        self._said = 0.0
        return True

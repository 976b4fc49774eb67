"""Front or back: the body turned round in the same place is fitted beside the one that is followed.

A body that is followed front for back explains its points almost as well, and goes on so: no step of a fit leads to
the other side. What tells is what remains when both are fitted: feet point forwards, knees and elbows bend one way,
the trunk lies before or behind its joints. One image tells it in most cases; several in a
row are asked. A head that is seen to face where the back should be speaks against it too.

Most of what is front for back begins as a body that stands in profile while who is seen turns on. Where the head
faces is measured from the side as well as from before, so that a body is begun anew there.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.joints import CANONICAL, MIRROR
from studio.engine.tracker.body import CANONICAL_BODIES, performer_of
from studio.engine.tracker.chain import ROOT_DOFS, Pose, rows_of
from studio.engine.tracker.fit import Figure, Fitter, Points, Prior
from studio.engine.tracker.limbs import LimbSearch
from studio.engine.tracker.silhouette import Silhouette
from studio.engine.tracker.start import cost_of, unexplained

Array = NDArray[np.float64]

_PLACE_SIGMA_M = 0.03
_STEPS = 6
_FITTED, _REACH_M = 4, 0.12
"""How a body and the one turned round are fitted: iterations, and distance at which points count little [m]."""
_LEGS_HEIGHT = 0.47
"""Share of the height below which points are of the legs, which tell front from back best: they count twice."""
_USED = np.array([i for i, name in enumerate(CANONICAL) if not name.endswith(("toe", "hand"))])
"""Joints that stay where they are: not those that point forwards."""


def turned_round(fitter: Fitter, figure: Figure, pose: Pose, posture: Array) -> Pose:
    """Return the pose with the front where the back is: the joints where those of the other side are, as far as its
    limits let them.

    Args:
        posture: how strongly angles tend to rest, shape (6 + dof_count,).
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
    figure: Figure,
    prior: Prior,
    points: Points,
    silhouettes: tuple[Silhouette, ...],
) -> tuple[tuple[float, float], Pose]:
    """Fit the expected pose and the one turned round; return what each leaves unexplained [m2], and the latter."""
    low = points.places[:, 2] < _LEGS_HEIGHT * performer_of(figure.shape).height_m
    costs, settled = [], prior.pose
    for pose in (prior.pose, turned_round(fitter, figure, prior.pose, prior.posture)):
        loose = Prior(pose, np.ones(len(prior.posture)), prior.posture)
        fit = fitter.fit(figure, pose, points, silhouettes, loose, iterations=_FITTED, reach=_REACH_M)
        cost = cost_of(search, figure, fit.pose, fit.distance, points, silhouettes)
        costs.append(cost + unexplained(fit.distance[low]))
        settled = fit.pose
    return (costs[0], costs[1]), settled


def joints_of(fitter: Fitter, figure: Figure, pose: Pose) -> tuple[Array, Array, Array]:
    """Return canonical joints [m], shape (21, 3), bodies' places and hinges' axes of a pose."""
    places, rotations, axes, *_ = fitter.place(figure, pose)
    offsets = np.einsum("jab,jb->ja", rotations[CANONICAL_BODIES], figure.canonical_offsets)
    return places[CANONICAL_BODIES] + offsets, places, axes


def forwards(pose: Pose) -> Array:
    """Return where a body faces, a horizontal unit vector, shape (2,)."""
    return -pose.rotation[:2, 1] / max(float(np.hypot(*pose.rotation[:2, 1])), 1e-9)


_SURELY = 0.7
"""A head that is seen so surely is a reason to try a body that faces as it does."""
_ASIDE = np.radians(30.0)
"""Where it faces further aside, it may glance, or the body lags behind who turns. From the side both explain the
points well, so that a body that explains them well is tried as well."""
_DOUBTED, _SIDE = 0.65, np.radians(45.0)
"""A body of a lower mean confidence is tried on either side of where its head faces: heads turn on the shoulders."""
_ASIDE_BETTER, _BETTER = 0.9, 0.8
"""A body begun where the head faces aside, and at its side, must leave less than this share unexplained."""


def aside_of(face: Array, pose: Pose) -> float | None:
    """Return the angle from where a body faces to where its head surely does [rad], None where that cannot be told;
    `face`: see `Heads.face`."""
    ahead = forwards(pose)
    angle = float(np.arctan2(ahead[0] * face[1] - ahead[1] * face[0], ahead @ face))
    return angle if np.hypot(*face) > _SURELY else None


_OFTEN, _SELDOM = 4, 30
"""Frames between two tests where front and back may have been exchanged lately, and elsewhere."""
_GLANCE = 2
"""Frames between two looks whether the head faces aside, where front and back may have been exchanged lately."""
_LATELY = 60
_PROFILE = 0.5
"""Cosine of the angle between heading and view under which a camera sees the body from the side."""
_KEPT = 0.9
"""Of what earlier tests said."""
_MOST = 0.1
"""One test says no more, and no more is kept in favour of the body that is followed: one image may mislead."""
_AGAINST = -0.1
"""A head that faces rather the other way is reason to test."""
_HEAD = 0.3
"""What a head says that surely faces straight ahead."""
_TURNED = -0.25
"""Sum of log ratios below which the body is turned round."""


class FacingWatch:
    """When to test whether front and back are exchanged, and what the tests said."""

    def __init__(self) -> None:
        self._unsure = _LATELY
        self._since = 0
        self._said = 0.0
        self._side = 1.0

    @property
    def unsure(self) -> bool:
        """Whether front and back may have been exchanged lately."""
        return self._unsure > 0

    @property
    def glances(self) -> bool:
        """Whether to look in this frame if the head faces aside."""
        return self.unsure and self._since % _GLANCE == 0

    def to_try(self, face: Array, pose: Pose, sure: float) -> tuple[float, float] | None:
        """Return by how much to turn a body begun anew [rad], and the share of the unexplained that it may leave;
        None where the head gives no reason.

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
        """Whether to look where the head faces in this frame, which comes next."""
        self._since += 1
        return self._since % _OFTEN == 0

    def due(self, pose: Pose, views: Array, head_ahead: float | None) -> bool:
        """Whether to test in this frame.

        Args:
            views: horizontal unit vectors from the cameras to the body, shape (camera_count, 2).
            head_ahead: see `told`; None where it was not looked at.
        """
        self._unsure = _LATELY if np.abs(views @ forwards(pose)).max() < _PROFILE else self._unsure - 1
        if head_ahead is not None and head_ahead < _AGAINST:
            self._unsure = max(self._unsure, _OFTEN)
        if self._since < (_OFTEN if self._unsure > 0 else _SELDOM):
            return False
        self._since = 0
        return True

    def told(self, cost_m2: float, turned_m2: float, head_ahead: float) -> bool:
        """Return whether the body turned round is to be followed.

        Args:
            cost_m2, turned_m2: what the body and the one turned round leave unexplained [m2].
            head_ahead: how surely the head faces where the body does: 1, it does; -1, it faces the other way; 0 where
                that cannot be told.
        """
        told = float(np.clip(np.log(turned_m2 / cost_m2), -_MOST, _MOST)) + _HEAD * head_ahead
        self._said = min(_KEPT * self._said + told, _MOST)
        if self._said > _TURNED:
            return False
        self._said = 0.0
        return True

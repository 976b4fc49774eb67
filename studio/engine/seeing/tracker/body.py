"""One body that is followed from instant to instant: its figure and pose, and the doubt about them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import unit
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.seeing.fitting.chain import Pose, chain_of
from studio.engine.seeing.fitting.cones import CANONICAL_BODIES, USUAL_HEIGHT_M, humanoid_of
from studio.engine.seeing.fitting.confidence import (
    LIMB_JOINTS,
    bounded,
    confidence_of,
    expected_errors,
    variances,
)
from studio.engine.seeing.fitting.confidence import BodyEvidence as SeenOnBody
from studio.engine.seeing.fitting.fit import BodyShape, Fit, Fitter, MeasuredPoints, Prior
from studio.engine.seeing.fitting.prediction import PosePredictor
from studio.engine.seeing.fitting.shape import ShapeEstimate
from studio.engine.seeing.fitting.timing import moved_along, worth_moving
from studio.engine.seeing.images.silhouette import Silhouette, behind_seen
from studio.engine.seeing.search.arms import ARMS, both_found
from studio.engine.seeing.search.bones import untold
from studio.engine.seeing.search.doubt import Doubt
from studio.engine.seeing.search.facing import FacingWatch, both_sides, forwards, joints_of
from studio.engine.seeing.search.jumps import Jumps
from studio.engine.seeing.search.limb_watch import LimbWatch
from studio.engine.seeing.search.limbs import LimbSearch, resting
from studio.engine.seeing.search.start import (
    BETTER,
    Start,
    best_start,
    cold_start,
    cost_of,
    head_says,
    heading,
    marked_standing,
    shape_of_height,
)
from studio.engine.seeing.search.unread import LegsUnread, marked, shown_of, unread_ends
from studio.engine.seeing.tracker.heads import Heads
from studio.engine.seeing.tracker.tracked import FittedBody, OnBody, TrackedSkeleton
from studio.engine.seeing.tracker.view import CameraView

Array = NDArray[np.float64]

LEAST_POINTS = 60
_LOST_S = 0.3
_EVERY_FRAME = 45
_EXPLAINED_M = 0.10
ARMS_LOST_M2 = 0.12
"""Smallest residual of both arms at which they are searched together [m2]."""
_KNOWN = 30
"""Number of frames after which a performer is known."""
_WELL_M2, _JUMPED_M2 = 0.00045, 0.0009
"""Residual per point below which a body is not restarted: usually, and after a jump [m2]."""


@cache
def usual_body() -> tuple[BodyShape, Fitter, LimbSearch]:
    """Return an average figure, its fitter and its limb search, which every tracker starts with; none has state."""
    figure = BodyShape.of(shape_of_height(USUAL_HEIGHT_M))
    fitter = Fitter(*chain_of(humanoid_of(figure.shape)))
    return figure, fitter, LimbSearch(fitter, figure)


@dataclass(frozen=True)
class Beginning:
    """A person found: the first pose, and the points, silhouettes and cameras that show it."""

    start: Start
    points: MeasuredPoints
    silhouettes: tuple[Silhouette, ...]
    seen_by: tuple[str, ...]


class FollowedBody:
    """A body that is followed, lost, or not started yet.

    Args:
        number: of the body within its tracker; it never changes.
        views: the cameras by name.

    Attributes:
        figure: the present estimate of the shape. motion: its pose and velocity. learnt: frames learnt from.
        doubled: frames for which it has lain on another body.
    """

    def __init__(self, number: int, views: Mapping[str, CameraView]) -> None:
        self.number, self._views = number, views
        self.figure, self.fitter, self._search = usual_body()
        self.motion = PosePredictor(self.fitter.limits)
        self.learnt = 0
        self.doubled = 0
        self._watch = LimbWatch()
        self._facing = FacingWatch()
        self._jumps = Jumps(JOINT_COUNT)
        self._heads = Heads(dict(views), {})
        self._shape: ShapeEstimate | None = None
        self._fit: Fit | None = None
        self._points: MeasuredPoints | None = None
        self._silhouettes: tuple[Silhouette, ...] = ()
        self._seen_by: tuple[str, ...] = ()
        self._legs = LegsUnread()
        self._fitted_ns = 0
        self._doubt = Doubt()
        self._sure = 1.0

    @property
    def tracked(self) -> bool:
        """Whether there is a pose to follow."""
        return self.motion.pose is not None

    @property
    def known(self) -> BodyShape | None:
        """The figure, if it has been learnt from enough frames."""
        return self.figure if self._shape is not None and self.learnt > _KNOWN else None

    @property
    def placed(self) -> tuple[BodyShape, Pose]:
        """Figure and pose of a body that is tracked."""
        assert self.motion.pose is not None
        return self.figure, self.motion.pose

    def apart_m(self, other: "FollowedBody") -> float:
        """Return the mean distance between the joints of two bodies [m]; infinite if one is not tracked."""
        if not (self.tracked and other.tracked):
            return np.inf
        mine, theirs = (joints_of(body.fitter, *body.placed)[0] for body in (self, other))
        return float(np.linalg.norm(mine - theirs, axis=1).mean())

    def on_body(self) -> OnBody | None:
        """Return the places of the last images' points on the body; None where it is not tracked."""
        if self._fit is None or self._points is None or len(self._fit.cone) != len(self._points.places):
            return None
        _, place, normal, _, distance = self.fitter.match(self.figure, self._fit.pose, self._points)
        return OnBody(self._points.places, place, normal, distance.min(axis=1), self._points.camera)

    def fitted(self) -> FittedBody | None:
        """Return the body as fitted to the last images' points; None where it is not tracked."""
        if self._fit is None or self._points is None:
            return None
        return FittedBody(self.figure, self._fit.pose, self._points)

    # --- beginning

    def lose(self) -> None:
        """Stop following until the body begins again; the figure stays known."""
        self.motion.pose, self._fit = None, None

    def beginning(self, points: MeasuredPoints, seen_by: Mapping[str, Silhouette], heads: Heads) -> Beginning:
        """Return the first pose of a person at the points, with the known figure or a usual one; change nothing.

        Args:
            seen_by: silhouettes by camera.
        """
        self._heads = heads
        silhouettes = marked_standing(self.fitter, points, tuple(seen_by.values()))
        start = best_start(
            self.fitter, self._search, self.known, points, silhouettes, self.motion.posture, self._ahead
        )
        return Beginning(start, points, silhouettes, tuple(seen_by))

    def begin(self, found: Beginning, time_ns: int) -> None:
        """Follow the person found from now on."""
        self._points, self._silhouettes, self._seen_by = found.points, found.silhouettes, found.seen_by
        self._take(found.start, time_ns)

    def _take(self, start: Start, time_ns: int) -> None:
        found = start.figure, start.fit.pose
        if self.motion.pose is not None:
            self._jumped(self.placed, found)
        for pose in start.others:
            self._jumped((start.figure, pose), found)
        if start.figure is not self.figure:
            self._shape, self.learnt = ShapeEstimate(start.figure.shape), 0
        self.figure, self._fit = start.figure, start.fit
        self.motion.restart(start.fit.pose)
        self._watch = LimbWatch()
        self._facing = FacingWatch()
        self._doubt = Doubt()
        self._sure = 1.0
        self._fitted_ns = time_ns

    def _jumped(self, before: tuple[BodyShape, Pose], after: tuple[BodyShape, Pose]) -> None:
        """Register a change of figure and pose for the same images."""
        self._jumps.told(*(joints_of(self.fitter, *one)[0] for one in (before, after)))

    # --- following

    def since_s(self, time_ns: int) -> float:
        """Return the time since the last fit [s]."""
        return max((time_ns - self._fitted_ns) * 1e-9, 0.0)

    def prior(self, time_ns: int) -> Prior:
        """Return the prior at a time."""
        return self.motion.prior(self.since_s(time_ns))

    def moved_from(
        self, times: Mapping[str, int], time_ns: int
    ) -> Callable[[str, MeasuredPoints], MeasuredPoints]:
        """Return a function that moves a camera's points from its time to `time_ns`, along with the body."""
        seconds = self.since_s(time_ns)
        delays_s = {name: (time - time_ns) * 1e-9 for name, time in times.items()}

        def moved(name: str, points: MeasuredPoints) -> MeasuredPoints:
            if not worth_moving(delays_s[name]):
                return points
            now = self.motion.after(seconds)
            then = self.motion.after(seconds + delays_s[name])
            return moved_along(self.fitter, self.figure, then, now, points)

        return moved

    def follow(
        self,
        prior: Prior,
        points: MeasuredPoints,
        seen_by: Mapping[str, Silhouette],
        time_ns: int,
        heads: Heads,
    ) -> None:
        """Fit the body to its points of a new instant, or give it up.

        Args:
            prior: of that instant. seen_by: silhouettes by camera.
        """
        seconds, self._heads = self.since_s(time_ns), heads
        self._jumps.fade()
        if len(points.places) < LEAST_POINTS:
            self._fit = None
            if seconds > _LOST_S:
                self.lose()
            return
        silhouettes = marked(self.fitter, self.figure, prior.pose, tuple(seen_by.values()), points)
        assert self.motion.pose is not None
        prior = resting(prior, self.motion.pose, self._search.limbs, silhouettes)
        ahead = self._ahead(self.figure, prior.pose) if self._facing.looks() else None
        due = self._facing.due(prior.pose, self._views_of(prior.pose), ahead)
        if due:
            prior = self._faced(prior, points, silhouettes)
        fit = self.fitter.fit(self.figure, prior.pose, points, silhouettes, prior, iterations=3)
        pose = self._searched(fit, points, silhouettes, prior)
        if pose is not fit.pose:
            fit = self.fitter.fit(self.figure, pose, points, silhouettes, prior, iterations=1)
        self.motion.update(fit.pose, fit.information, seconds)
        self._fit, self._fitted_ns = fit, time_ns
        self._points, self._silhouettes, self._seen_by = points, silhouettes, tuple(seen_by)
        self._learn(points, silhouettes, prior)
        self._check(points, silhouettes, time_ns, turning=due and self._facing.unsure)

    def _faced(self, prior: Prior, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...]) -> Prior:
        """Return the prior, turned round if that explains the points better."""
        costs_m2, turned = both_sides(self.fitter, self._search, self.figure, prior, points, silhouettes)
        if not self._facing.told(*costs_m2, self._ahead(self.figure, prior.pose)):
            return prior
        self._jumped((self.figure, prior.pose), (self.figure, turned))
        self.motion.restart(turned)
        self._watch = LimbWatch()
        self._doubt.turned()
        return self.motion.prior(0.0)

    def _face(self, figure: BodyShape, pose: Pose) -> Array:
        """Return the direction of a body's head; see `Heads.face`."""
        return self._heads.face(joints_of(self.fitter, figure, pose)[0][INDEX["head"]])

    def _ahead(self, figure: BodyShape, pose: Pose) -> float:
        """Return the agreement of head and body: 1 = they face the same way; -1 = opposite ways."""
        return float(self._face(figure, pose) @ forwards(pose))

    def _views_of(self, pose: Pose) -> Array:
        """Return horizontal unit vectors from the cameras to a body, shape (camera_count, 2)."""
        return unit(pose.root[:2] - np.stack([view.eye[:2] for view in self._views.values()]))

    def _searched(
        self, fit: Fit, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...], prior: Prior
    ) -> Pose:
        """Return the pose with lost limbs recovered."""
        pose = fit.pose
        for limb in self._search.limbs:
            threshold = self._watch.threshold_m2(limb.part)
            before = pose
            pose, cost = self._search.search(
                limb, self.figure, pose, fit.distance, points, silhouettes, prior, threshold
            )
            found = pose is not before
            self._watch.told(limb.part, cost, searched=found or cost >= threshold, found=found)
        if self._watch.costs_m2[list(ARMS)].min() > ARMS_LOST_M2:
            pose = both_found(self.fitter, self._search, self.figure, pose, points, silhouettes, prior)
        return pose

    def _learn(self, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...], prior: Prior) -> None:
        """Update the performer's shape: with every frame at first, then with some of them."""
        assert self._shape is not None and self._fit is not None
        self.learnt += 1
        if self.learnt < _EVERY_FRAME or self.learnt % 4 == 0:
            self.figure = self._shape.update(self.fitter, self._fit, points, silhouettes, prior)

    def _check(
        self, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...], time_ns: int, *, turning: bool
    ) -> None:
        """Restart a body that has not explained the points for some time, or may be lost in a turn."""
        assert self._fit is not None
        explained = float((self._fit.distance.min(axis=1) < _EXPLAINED_M).mean())
        worst_m2 = float(self._watch.costs_m2.max())
        turns = self._doubt.turns(explained, worst_m2, self._sure, turning=turning)
        if self._doubt.lost:
            self.lose()
            return
        pose, face = self._fit.pose, np.zeros(2)
        if self._facing.glances:
            face = self._face(self.figure, pose)
        to_try = self._facing.to_try(face, pose, self._sure)
        if to_try is not None:
            turn, better = to_try
            self._begin_at(np.array([turn]), points, silhouettes, time_ns, well_m2=0.0, better=better)
        elif len(turns):
            well_m2 = _JUMPED_M2 if len(turns) > 1 else _WELL_M2
            self._begin_at(turns, points, silhouettes, time_ns, well_m2=well_m2, better=BETTER)

    def _begin_at(
        self,
        turns: Array,
        points: MeasuredPoints,
        silhouettes: tuple[Silhouette, ...],
        time_ns: int,
        *,
        well_m2: float,
        better: float,
    ) -> None:
        """Restart with one of these turns [rad] if it leaves less than the share `better` of the residual, unless the
        residual per point is below `well_m2`.
        """
        fit = self._fit
        assert fit is not None
        headings = list(heading(fit.pose) + turns)
        cost = cost_of(self._search, self.figure, fit.pose, fit.distance, points, silhouettes)
        cost *= head_says(self._ahead(self.figure, fit.pose))
        if cost < well_m2 * len(points.places):
            return
        start = cold_start(
            self.fitter,
            self._search,
            self.figure,
            points,
            silhouettes,
            self.motion.posture,
            headings,
            self._ahead,
        )
        if start.cost_m2 < better * cost:
            self._take(start, time_ns)

    def skeleton(self, time_ns: int) -> TrackedSkeleton:
        """Return the skeleton in the working frame."""
        pose = self.motion.pose
        if pose is None or self._fit is None or self._points is None:
            status = "searching" if self._shape is None else "lost"
            self._legs = LegsUnread()
            nowhere = np.full((JOINT_COUNT, 3), np.nan)
            return TrackedSkeleton(time_ns, nowhere, np.zeros(JOINT_COUNT), status, body=self.number)
        joints, places, axes = joints_of(self.fitter, self.figure, pose)
        self._shown = shown_of(self.fitter, self.figure, pose, self._silhouettes)
        self._legs.told(time_ns, dict(zip(self._seen_by, self._shown.why, strict=True)))
        errors_m = self._errors(self._fit, self._points, joints, places, axes)
        seen = ~self._shown.hidden[CANONICAL_BODIES[LIMB_JOINTS]]
        self._sure = float(confidence_of(errors_m[LIMB_JOINTS][seen]).mean()) if seen.any() else 1.0
        told = untold(self.fitter, self.figure, self._fit, self._points)
        confidence = confidence_of(bounded(errors_m, self._jumps.least_m(told)))
        return TrackedSkeleton(time_ns, joints, confidence, "tracked", self._legs.why, self.number)

    def _errors(self, fit: Fit, points: MeasuredPoints, joints: Array, places: Array, axes: Array) -> Array:
        """Return the expected error of each canonical joint [m], shape (21,)."""
        variance, seen = self._weighed(fit, points, joints, places, axes)
        return expected_errors(self.fitter.chain, joints, variance, seen)

    def _weighed(
        self, fit: Fit, points: MeasuredPoints, joints: Array, places: Array, axes: Array
    ) -> tuple[Array, SeenOnBody]:
        """Return the variances of the canonical joints [m2], shape (21,), and the other evidence of their
        confidence."""
        variance = variances(self.fitter.chain, places, axes, joints, self.motion.covariance)
        return variance, SeenOnBody(
            points.places,
            self.figure.surface.body[fit.cone],
            fit.distance.min(axis=1),
            behind_seen(self._silhouettes, joints),
            self._watch.costs_m2,
            self._watch.lately_m2,
            unread_ends(self.fitter, self.figure, fit, points, self._shown),
        )

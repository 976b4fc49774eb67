"""The skeleton tracker: from depth images of one or several cameras to one skeleton."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

import studio.engine.base.blas  # noqa: F401, so that equal input gives equal bits
from studio.engine.base.errors import CalibrationError
from studio.engine.base.geometry import invert_transform, transform_points, unit
from studio.engine.model.calibration import Performer
from studio.engine.model.depth import DepthCamera, DepthFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.seeing.fitting.chain import Pose, chain_of
from studio.engine.seeing.fitting.cones import CANONICAL_BODIES, USUAL_HEIGHT_M, humanoid_of, performer_of
from studio.engine.seeing.fitting.confidence import LIMB_JOINTS, confidence_of, expected_errors, variances
from studio.engine.seeing.fitting.confidence import BodyEvidence as SeenOnBody
from studio.engine.seeing.fitting.fit import BodyShape, Fit, Fitter, MeasuredPoints, Prior
from studio.engine.seeing.fitting.prediction import PosePredictor
from studio.engine.seeing.fitting.shape import ShapeEstimate
from studio.engine.seeing.fitting.timing import moved_along, worth_moving
from studio.engine.seeing.images.silhouette import Silhouette, behind_seen
from studio.engine.seeing.search.arms import ARMS, both_found
from studio.engine.seeing.search.doubt import Doubt
from studio.engine.seeing.search.facing import FacingWatch, both_sides, forwards, joints_of
from studio.engine.seeing.search.limb_watch import LimbWatch
from studio.engine.seeing.search.limbs import LimbSearch, resting
from studio.engine.seeing.search.start import (
    Start,
    best_start,
    cold_start,
    cost_of,
    head_says,
    heading,
    marked_standing,
    shape_of_height,
)
from studio.engine.seeing.search.unread import LegsUnread, marked, shown_of
from studio.engine.seeing.tracker.heads import Heads
from studio.engine.seeing.tracker.looking import Looker
from studio.engine.seeing.tracker.person import at_place, candidates, may_be_person, near_body
from studio.engine.seeing.tracker.tracked import FittedBody, OnBody, TrackedSkeleton
from studio.engine.seeing.tracker.view import CameraView, ImageClusters

Array = NDArray[np.float64]

POINT_COUNT = 1000
"""Number of points of all cameras together to which the body is fitted."""
_LEAST_POINTS = 60
_LOST_S = 0.3
_NOBODY_M2 = 0.006
"""Largest residual of a person per point [m2]."""
_REST = 2
"""Frames between searches for a person."""
_EVERY_FRAME = 45
_EXPLAINED_M = 0.10
ARMS_LOST_M2 = 0.12
"""Smallest residual of both arms at which they are searched together [m2]."""
_KNOWN = 30
"""A performer is known after this many frames."""
_WELL_M2, _JUMPED_M2 = 0.00045, 0.0009
"""Residuals per point below which a body fits well, and below which it has not jumped [m2]."""
_BETTER = 0.6
"""Another pose must leave less than this share of the residual."""


@cache
def _usual_body() -> tuple[BodyShape, Fitter, LimbSearch]:
    """Return an average figure, its fitter and its limbs' poses, the initial ones of every tracker; none has a
    state."""
    figure = BodyShape.of(shape_of_height(USUAL_HEIGHT_M))
    fitter = Fitter(*chain_of(humanoid_of(figure.shape)))
    return figure, fitter, LimbSearch(fitter, figure)


class Tracker:
    """Tracks one performer through depth images.

    Args:
        cameras: intrinsics by name.
        T_stage_camera: camera points to the stage, by name; None for one camera alone, whose skeleton is then in
            its own frame.

    Raises:
        CalibrationError: several cameras without transforms.
    """

    def __init__(
        self, cameras: dict[str, DepthCamera], T_stage_camera: dict[str, Array] | None = None
    ) -> None:
        if T_stage_camera is None and len(cameras) != 1:
            raise CalibrationError(
                "tracker.no_transforms",
                "several cameras make one skeleton only with their transforms; calibrate first",
            )
        missing = [name for name in cameras if T_stage_camera is not None and name not in T_stage_camera]
        if missing:
            raise CalibrationError(
                "tracker.no_transform",
                "no transform of camera {names}; calibrate the stage again",
                names=[*missing],
            )
        self._own_frame = T_stage_camera is None
        self._views = {
            name: CameraView(camera, None if T_stage_camera is None else T_stage_camera[name])
            for name, camera in cameras.items()
        }
        self._figure, self._fitter, self._search = _usual_body()
        self._motion = PosePredictor(self._fitter.limits)
        self._watch = LimbWatch()
        self._facing = FacingWatch()
        self._heads = Heads(self._views, {})
        self._looker = Looker(self._views)
        self._shape: ShapeEstimate | None = None
        self._fit: Fit | None = None
        self._points: MeasuredPoints | None = None
        self._silhouettes: tuple[Silhouette, ...] = ()
        self._seen_by: tuple[str, ...] = ()
        self._legs = LegsUnread()
        self._time_ns = 0
        self._fitted_ns = 0
        self._learnt = 0
        self._doubt = Doubt()
        self._sure = 1.0
        self._rest = 0

    @property
    def performer(self) -> Performer:
        """The present estimate of the performer's proportions."""
        return performer_of(self._figure.shape)

    def on_body(self) -> OnBody | None:
        """Return the places of the last images' points on the body; None where nobody is tracked."""
        if self._fit is None or self._points is None or len(self._fit.cone) != len(self._points.places):
            return None
        _, place, normal, _, distance = self._fitter.match(self._figure, self._fit.pose, self._points)
        return OnBody(self._points.places, place, normal, distance.min(axis=1), self._points.camera)

    def fitted(self) -> FittedBody | None:
        """Return the body as fitted to the last images' points; None where nobody is followed."""
        if self._fit is None or self._points is None:
            return None
        return FittedBody(self._figure, self._fit.pose, self._points)

    def forget_pose(self) -> None:
        """Look for the performer anew in the next images, which are of another time; proportions stay known."""
        self._motion.pose = None
        self._rest = 0

    def track(
        self, frames: dict[str, DepthFrame], following: dict[str, DepthFrame] | None = None
    ) -> TrackedSkeleton:
        """Return the skeleton at the mean time of the frames.

        Args:
            frames: at most one per camera, on a common clock, not necessarily at one instant.
            following: the next ones, which are looked at while the body is fitted; they change nothing.

        Raises:
            FormatError: the size of an image is not its camera's.
        """
        times = {name: frame.device_time_ns for name, frame in frames.items()}
        time_ns = sum(times.values()) // len(times) if times else self._time_ns
        seen = self._looker.seen(frames)
        self._looker.expect(following)
        self._heads = Heads(self._views, frames)
        if self._motion.pose is not None:
            self._follow(seen, times, time_ns)
        if self._motion.pose is None:
            self._start(seen, time_ns)
        self._time_ns = time_ns
        return self._skeleton(time_ns)

    def _gather(
        self,
        seen: dict[str, ImageClusters],
        chosen: dict[str, NDArray[np.bool_]],
        delays_s: dict[str, float] | None = None,
    ) -> tuple[MeasuredPoints, dict[str, Silhouette]]:
        """Return the chosen clusters' points, moved to one instant, and their silhouettes by camera."""

        def moved(name: str, points: MeasuredPoints) -> MeasuredPoints:
            if delays_s is None or not worth_moving(delays_s[name]):
                return points
            now = self._motion.after(delays_s["now"])
            then = self._motion.after(delays_s["now"] + delays_s[name])
            return moved_along(self._fitter, self._figure, then, now, points)

        return self._looker.gathered(seen, chosen, POINT_COUNT // max(len(seen), 1), moved)

    def _start(self, seen: dict[str, ImageClusters], time_ns: int) -> None:
        """Search for a person among the clusters."""
        self._looker.drop()
        for name, view in seen.items():
            self._views[name].learn_background(view, may_be_person(view))
        self._looker.begin()
        self._fit = None
        if self._rest > 0:  # not in every frame after a search without a result
            self._rest -= 1
            return
        for place in candidates(seen, None if self._own_frame else np.zeros(2)):
            points, seen_by = self._gather(seen, {name: at_place(view, place) for name, view in seen.items()})
            if len(points.places) < _LEAST_POINTS:
                continue
            silhouettes = marked_standing(self._fitter, points, tuple(seen_by.values()))
            known = self._figure if self._shape is not None and self._learnt > _KNOWN else None
            start = best_start(
                self._fitter, self._search, known, points, silhouettes, self._motion.posture, self._ahead
            )
            if start.cost_m2 > _NOBODY_M2 * len(points.places):
                continue
            self._points, self._silhouettes, self._seen_by = points, silhouettes, tuple(seen_by)
            self._take(start, time_ns)
            return
        self._rest = _REST

    def _take(self, start: Start, time_ns: int) -> None:
        if start.figure is not self._figure:
            self._shape, self._learnt = ShapeEstimate(start.figure.shape), 0
        self._figure, self._fit = start.figure, start.fit
        self._motion.restart(start.fit.pose)
        self._watch = LimbWatch()
        self._facing = FacingWatch()
        self._doubt = Doubt()
        self._sure = 1.0
        self._fitted_ns = time_ns

    def _follow(self, seen: dict[str, ImageClusters], times: dict[str, int], time_ns: int) -> None:
        """Track the performer to a new instant, or give up."""
        seconds = max((time_ns - self._fitted_ns) * 1e-9, 0.0)
        prior = self._motion.prior(seconds)
        chosen = {
            name: near_body(view, self._fitter, self._figure, prior.pose, self._eye(name))
            for name, view in seen.items()
        }
        for name, view in seen.items():
            self._views[name].learn_background(view, may_be_person(view) | chosen[name])
        delays_s = {name: (time - time_ns) * 1e-9 for name, time in times.items()} | {"now": seconds}
        points, seen_by = self._gather(seen, chosen, delays_s)
        self._looker.begin()
        if len(points.places) < _LEAST_POINTS:
            self._fit = None
            if seconds > _LOST_S:
                self._motion.pose = None
            return
        silhouettes = marked(self._fitter, self._figure, prior.pose, tuple(seen_by.values()), points)
        assert self._motion.pose is not None
        prior = resting(prior, self._motion.pose, self._search.limbs, silhouettes)
        ahead = self._ahead(self._figure, prior.pose) if self._facing.looks() else None
        due = self._facing.due(prior.pose, self._views_of(prior.pose), ahead)
        if due:
            prior = self._faced(prior, points, silhouettes)
        fit = self._fitter.fit(self._figure, prior.pose, points, silhouettes, prior, iterations=3)
        pose = self._searched(fit, points, silhouettes, prior)
        if pose is not fit.pose:
            fit = self._fitter.fit(self._figure, pose, points, silhouettes, prior, iterations=1)
        self._motion.update(fit.pose, fit.information, seconds)
        self._fit, self._fitted_ns = fit, time_ns
        self._points, self._silhouettes, self._seen_by = points, silhouettes, tuple(seen_by)
        self._learn(points, silhouettes, prior)
        self._check(points, silhouettes, time_ns, turning=due and self._facing.unsure)

    def _faced(self, prior: Prior, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...]) -> Prior:
        """Return the prior, turned round if that explained more."""
        costs_m2, turned = both_sides(self._fitter, self._search, self._figure, prior, points, silhouettes)
        if not self._facing.told(*costs_m2, self._ahead(self._figure, prior.pose)):
            return prior
        self._motion.restart(turned)
        self._watch = LimbWatch()
        self._doubt.turned()
        return self._motion.prior(0.0)

    def _face(self, figure: BodyShape, pose: Pose) -> Array:
        """Return the direction of a body's head; see `Heads.face`."""
        return self._heads.face(joints_of(self._fitter, figure, pose)[0][INDEX["head"]])

    def _ahead(self, figure: BodyShape, pose: Pose) -> float:
        """Return the agreement of head and body: 1, they face the same way; -1, opposite ways."""
        return float(self._face(figure, pose) @ forwards(pose))

    def _views_of(self, pose: Pose) -> Array:
        """Return horizontal unit vectors from the cameras to a body, shape (camera_count, 2)."""
        return unit(pose.root[:2] - np.stack([self._eye(name)[:2] for name in self._views]))

    def _searched(
        self, fit: Fit, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...], prior: Prior
    ) -> Pose:
        """Return the pose with lost limbs recovered."""
        pose = fit.pose
        for limb in self._search.limbs:
            threshold = self._watch.threshold_m2(limb.part)
            before = pose
            pose, cost = self._search.search(
                limb, self._figure, pose, fit.distance, points, silhouettes, prior, threshold
            )
            found = pose is not before
            self._watch.told(limb.part, cost, searched=found or cost >= threshold, found=found)
        if self._watch.costs_m2[list(ARMS)].min() > ARMS_LOST_M2:
            pose = both_found(self._fitter, self._search, self._figure, pose, points, silhouettes, prior)
        return pose

    def _learn(self, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...], prior: Prior) -> None:
        """Update the performer's shape: with every frame at first, then with some."""
        assert self._shape is not None and self._fit is not None
        self._learnt += 1
        if self._learnt < _EVERY_FRAME or self._learnt % 4 == 0:
            self._figure = self._shape.update(self._fitter, self._fit, points, silhouettes, prior)

    def _check(
        self, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...], time_ns: int, *, turning: bool
    ) -> None:
        """Restart a body that has not explained the points for some time, or may be lost in a turn."""
        assert self._fit is not None
        explained = float((self._fit.distance.min(axis=1) < _EXPLAINED_M).mean())
        worst_m2 = float(self._watch.costs_m2.max())
        turns = self._doubt.turns(explained, worst_m2, self._sure, turning=turning)
        if self._doubt.lost:
            self._motion.pose = None
            return
        pose, face = self._fit.pose, np.zeros(2)
        if self._facing.glances:
            face = self._face(self._figure, pose)
        to_try = self._facing.to_try(face, pose, self._sure)
        if to_try is not None:
            turn, better = to_try
            self._begin_at(np.array([turn]), points, silhouettes, time_ns, well_m2=0.0, better=better)
        elif len(turns):
            well_m2 = _JUMPED_M2 if len(turns) > 1 else _WELL_M2
            self._begin_at(turns, points, silhouettes, time_ns, well_m2=well_m2, better=_BETTER)

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
        """Restart with one of these turns [rad], if it leaves less than a share of the residual, unless the residual
        per point is below `well_m2`.
        """
        fit = self._fit
        assert fit is not None
        headings = list(heading(fit.pose) + turns)
        cost = cost_of(self._search, self._figure, fit.pose, fit.distance, points, silhouettes)
        cost *= head_says(self._ahead(self._figure, fit.pose))
        if cost < well_m2 * len(points.places):
            return
        start = cold_start(
            self._fitter,
            self._search,
            self._figure,
            points,
            silhouettes,
            self._motion.posture,
            headings,
            self._ahead,
        )
        if start.cost_m2 < better * cost:
            self._take(start, time_ns)

    def _eye(self, name: str) -> Array:
        T = self._views[name].T_work_camera
        assert T is not None
        return T[:3, 3]

    def _skeleton(self, time_ns: int) -> TrackedSkeleton:
        pose = self._motion.pose
        if pose is None or self._fit is None or self._points is None:
            status = "searching" if self._shape is None else "lost"
            self._legs = LegsUnread()
            return TrackedSkeleton(time_ns, np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT), status)
        joints, places, axes = joints_of(self._fitter, self._figure, pose)
        self._shown = shown_of(self._fitter, self._figure, pose, self._silhouettes)
        self._legs.told(time_ns, dict(zip(self._seen_by, self._shown.why, strict=True)))
        errors_m = self._errors(self._fit, self._points, joints, places, axes)
        if self._own_frame:
            T = next(iter(self._views.values())).T_work_camera
            assert T is not None
            joints = transform_points(invert_transform(T), joints)
        confidence = confidence_of(errors_m)
        seen = ~self._shown.hidden[CANONICAL_BODIES[LIMB_JOINTS]]
        self._sure = float(confidence[LIMB_JOINTS][seen].mean()) if seen.any() else 1.0
        return TrackedSkeleton(time_ns, joints, confidence, "tracked", self._legs.why)

    def _errors(self, fit: Fit, points: MeasuredPoints, joints: Array, places: Array, axes: Array) -> Array:
        """Return the expected error of each canonical joint [m], shape (21,)."""
        variance, seen = self._weighed(fit, points, joints, places, axes)
        return expected_errors(self._fitter.chain, joints, variance, seen)

    def _weighed(
        self, fit: Fit, points: MeasuredPoints, joints: Array, places: Array, axes: Array
    ) -> tuple[Array, SeenOnBody]:
        """Return the variances of the canonical joints [m2], shape (21,), and the other evidence of their
        confidence."""
        variance = variances(self._fitter.chain, places, axes, joints, self._motion.covariance)
        return variance, SeenOnBody(
            points.places,
            self._figure.surface.body[fit.cone],
            fit.distance.min(axis=1),
            behind_seen(self._silhouettes, joints),
            self._watch.costs_m2,
            self._watch.lately_m2,
            self._shown.hidden,
            self._shown.ends,
        )

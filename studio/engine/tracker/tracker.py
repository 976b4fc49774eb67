"""The skeleton tracker: depth images of one or several cameras in, one skeleton out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.result import Performer
from studio.engine.depth import DepthCamera, DepthFrame
from studio.engine.errors import CalibrationError
from studio.engine.geometry import invert_transform, transform_points
from studio.engine.joints import JOINT_COUNT
from studio.engine.tracker.body import CANONICAL_BODIES, canonical_offsets_of, humanoid_of, performer_of
from studio.engine.tracker.chain import chain_of
from studio.engine.tracker.fit import Figure, Fit, Fitter, Points
from studio.engine.tracker.limbs import LimbSearch
from studio.engine.tracker.motion import Motion
from studio.engine.tracker.person import at_place, candidates, may_be_person, near_body
from studio.engine.tracker.shape import ShapeEstimate
from studio.engine.tracker.silhouette import Silhouette
from studio.engine.tracker.start import cold_start, height_of, shape_of_height, yaws
from studio.engine.tracker.view import CameraView, Seen

Array = NDArray[np.float64]

POINT_COUNT = 1000
"""Points of all cameras together that the body is fitted to."""
_LEAST_POINTS = 60
_LOST_S = 0.3


@dataclass(frozen=True)
class TrackedSkeleton:
    """One skeleton.

    Attributes:
        time_ns: the instant it stands for, on the cameras' common clock.
        positions: canonical joints [m], shape (21, 3), in the stage frame, or the camera's own where the tracker got
            no transforms; NaN = nobody is tracked.
        confidence: shape (21,), 0..1.
        status: `tracked`, `searching` (nobody yet) or `lost`.
    """

    time_ns: int
    positions: Array
    confidence: Array
    status: str


class Tracker:
    """Tracks one performer through depth images.

    Args:
        cameras: intrinsics by name.
        T_stage_camera: camera points to the stage, by name; None for one camera alone, whose skeleton then comes in
            its own frame.

    Raises:
        CalibrationError: several cameras without transforms.
    """

    def __init__(
        self, cameras: dict[str, DepthCamera], T_stage_camera: dict[str, Array] | None = None
    ) -> None:
        if T_stage_camera is None and len(cameras) != 1:
            raise CalibrationError(
                "several cameras make one skeleton only with their transforms; calibrate first"
            )
        missing = [name for name in cameras if T_stage_camera is not None and name not in T_stage_camera]
        if missing:
            raise CalibrationError(f"no transform of camera {', '.join(missing)}; calibrate the stage again")
        self._own_frame = T_stage_camera is None
        self._views = {
            name: CameraView(camera, None if T_stage_camera is None else T_stage_camera[name])
            for name, camera in cameras.items()
        }
        self._figure = Figure.of(shape_of_height(1.72))
        chain, limits = chain_of(humanoid_of(self._figure.shape))
        self._fitter = Fitter(chain, limits)
        self._search = LimbSearch(self._fitter, self._figure)
        self._motion = Motion(limits)
        self._time_ns = 0
        self._seen_ns = 0
        self._fit: Fit | None = None
        self.costs = np.zeros(5)

    @property
    def performer(self) -> Performer:
        """The performer's proportions as known by now."""
        return performer_of(self._figure.shape)

    def track(self, frames: dict[str, DepthFrame]) -> TrackedSkeleton:
        """Return the skeleton at the mean time of the frames.

        Args:
            frames: at most one per camera, on a common clock, not all at one instant.
        """
        times = {name: frame.device_time_ns for name, frame in frames.items()}
        time_ns = round(sum(times.values()) / max(len(times), 1)) if times else self._time_ns
        seen = {name: self._views[name].see(frame.depth_mm) for name, frame in frames.items()}
        if self._motion.pose is None:
            self._start(seen)
        else:
            self._follow(seen, times, time_ns)
        if self._motion.pose is not None:
            self._seen_ns = max(self._seen_ns, time_ns) if self._fit is not None else self._seen_ns
        self._time_ns = time_ns
        return self._skeleton(time_ns)

    def _gather(
        self, seen: dict[str, Seen], chosen: dict[str, NDArray[np.bool_]]
    ) -> tuple[Points, tuple[Silhouette, ...]]:
        parts, silhouettes = [], []
        share = max(POINT_COUNT // max(len(seen), 1), 1)
        for index, (name, view) in enumerate(seen.items()):
            if chosen[name].any():
                parts.append(self._views[name].points_of(view, chosen[name], share, index))
                silhouettes.append(self._views[name].silhouette_of(view, chosen[name]))
        if not parts:
            return Points(*(np.zeros((0, 3)),) * 3, np.zeros(0, np.int64)), ()
        return Points(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True))), tuple(silhouettes)

    def _start(self, seen: dict[str, Seen]) -> None:
        for name, view in seen.items():
            self._views[name].learn_background(view, may_be_person(view))
        for place in candidates(seen, None if self._own_frame else np.zeros(2)):
            chosen = {name: at_place(view, place) for name, view in seen.items()}
            points, silhouettes = self._gather(seen, chosen)
            if len(points.places) < _LEAST_POINTS:
                continue
            figure = Figure.of(shape_of_height(height_of(points)))
            start = cold_start(
                self._fitter, self._search, figure, points, silhouettes, self._motion.posture, yaws(points)
            )
            self._figure = figure
            self._shape = ShapeEstimate(figure.shape)
            self._learnt = 0
            self._motion.restart(start.fit.pose)
            self._fit = start.fit
            return

    def _follow(self, seen: dict[str, Seen], times: dict[str, int], time_ns: int) -> None:
        seconds = max((time_ns - self._time_ns) * 1e-9, 0.0)
        prior = self._motion.prior(seconds)
        chosen = {
            name: near_body(view, self._fitter, self._figure, prior.pose, self._eye(name))
            for name, view in seen.items()
        }
        for name, view in seen.items():
            self._views[name].learn_background(view, may_be_person(view) | chosen[name])
        points, silhouettes = self._gather(seen, chosen)
        if len(points.places) < _LEAST_POINTS:
            self._fit = None
            if (time_ns - self._seen_ns) * 1e-9 > _LOST_S:
                self._motion.pose = None
            return
        fit = self._fitter.fit(self._figure, prior.pose, points, silhouettes, prior, iterations=3)
        pose = fit.pose
        for limb in self._search.limbs:
            pose, self.costs[limb.part] = self._search.search(
                limb, self._figure, pose, fit.distance, points, silhouettes, prior
            )
        if pose is not fit.pose:
            fit = self._fitter.fit(self._figure, pose, points, silhouettes, prior, iterations=1)
        self._motion.update(fit.pose, fit.information, seconds)
        self._fit = fit
        self._learnt += 1
        if self._learnt < 45 or self._learnt % 3 == 0:
            self._figure = self._shape.update(self._fitter, fit, points, silhouettes, prior)

    def _eye(self, name: str) -> Array:
        T = self._views[name].T_work_camera
        assert T is not None
        return T[:3, 3]

    def _skeleton(self, time_ns: int) -> TrackedSkeleton:
        pose = self._motion.pose
        if pose is None or self._fit is None:
            return TrackedSkeleton(
                time_ns, np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT), "searching"
            )
        places, rotations, *_ = self._fitter.place(self._figure, pose)
        offsets = canonical_offsets_of(self._figure.shape)
        positions = places[CANONICAL_BODIES] + np.einsum("jab,jb->ja", rotations[CANONICAL_BODIES], offsets)
        if self._own_frame:
            T = next(iter(self._views.values())).T_work_camera
            assert T is not None
            positions = transform_points(invert_transform(T), positions)
        return TrackedSkeleton(time_ns, positions, np.ones(JOINT_COUNT), "tracked")

"""The skeleton tracker: from depth images of one or several cameras to the skeletons of everybody they show."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import studio.engine.base.blas  # noqa: F401, so that equal input gives equal bits
from studio.engine.base.errors import CalibrationError
from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.calibration import Performer
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.seeing.bodies.cells import PlacedBodies
from studio.engine.seeing.fitting.cones import performer_of
from studio.engine.seeing.fitting.fit import MeasuredPoints, Prior
from studio.engine.seeing.images.silhouette import Silhouette
from studio.engine.seeing.tracker.body import LEAST_POINTS, Beginning, FollowedBody
from studio.engine.seeing.tracker.heads import Heads
from studio.engine.seeing.tracker.looking import Looker
from studio.engine.seeing.tracker.newcomers import Newcomers, parted, rest_of
from studio.engine.seeing.tracker.person import at_place, candidates, may_be_person
from studio.engine.seeing.tracker.shares import Share, share_of_one, shares_of
from studio.engine.seeing.tracker.tracked import FittedBody, OnBody, TrackedSkeleton
from studio.engine.seeing.tracker.view import CameraView, ImageClusters

Array = NDArray[np.float64]

POINT_COUNT = 1000
"""Number of points, from all cameras together, to which a body is fitted."""
MOST_BODIES = 8
"""Maximum number of performers that are tracked."""
_NOBODY_M2, _NOBODY_NEW_M2 = 0.006, 0.0012
"""Largest residual per point of a person, and of a new person while others are followed [m2]."""
_FORGET_S = 10.0
_REST = 2
"""Frames between searches for a person."""
_SAME_M, _SAME_FRAMES = 0.12, 10
"""Two bodies within this distance [m] for this number of frames count as one."""


class Tracker:
    """Tracks performers through depth images, including those who come in later.

    Args:
        cameras: intrinsics by name.
        T_stage_camera: camera points to the stage, by name; None for a single camera, whose skeleton is then in its
            own frame.

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
        self.bodies = [FollowedBody(0, self._views)]
        self._heads = Heads(self._views, {})
        self._looker = Looker(self._views)
        self._newcomers = Newcomers()
        self._time_ns = 0
        self._rest = 0

    @property
    def performer(self) -> Performer:
        """The present estimate of the first performer's proportions."""
        return performer_of(self.bodies[0].figure.shape)

    def on_body(self) -> OnBody | None:
        """Return the places of the last images' points on the first body; None where it is not tracked."""
        return self.bodies[0].on_body()

    def fitted(self) -> FittedBody | None:
        """Return the first body as fitted to the last images' points; None where it is not tracked."""
        return self.bodies[0].fitted()

    def forget_pose(self) -> None:
        """Search for performers again in the next images, which are from another time; proportions stay known."""
        for body in self.bodies:
            body.lose()
        self._rest = 0

    def track(
        self, frames: dict[str, DepthFrame], following: dict[str, DepthFrame] | None = None
    ) -> TrackedSkeleton:
        """Return the skeletons at the mean time of the frames: the first one that is tracked, with the others.

        Args:
            frames: at most one per camera, on a common clock, not necessarily at one instant.
            following: the next frames, processed in advance while bodies are fitted; they do not affect the result.

        Raises:
            FormatError: the size of an image is not its camera's.
        """
        times = {name: frame.device_time_ns for name, frame in frames.items()}
        time_ns = sum(times.values()) // len(times) if times else self._time_ns
        seen = self._looker.seen(frames)
        self._looker.expect(following)
        self._heads = Heads(self._views, frames)
        followed = [body for body in self.bodies if body.tracked]
        if followed:
            shares = self._follow(followed, seen, times, time_ns)
            if self._newcomers.looks(seen, shares):
                self._welcome(seen, shares, time_ns)
        if not any(body.tracked for body in self.bodies):
            self._start(seen, time_ns)
        self._time_ns = time_ns
        skeletons = [self._in_own_frame(body.skeleton(time_ns)) for body in self.bodies]
        first, *others = [one for one in skeletons if one.status == "tracked"] or skeletons[:1]
        return replace(first, others=tuple(others)) if others else first

    # --- following

    def _follow(
        self,
        followed: list[FollowedBody],
        seen: dict[str, ImageClusters],
        times: dict[str, int],
        time_ns: int,
    ) -> list[Share]:
        """Follow bodies to a new instant, or give them up; return each body's share of the images."""
        priors = [body.prior(time_ns) for body in followed]
        shares = self._shares(followed, priors, seen)
        for name, view in seen.items():
            chosen = np.any([share.chosen[name] for share in shares], axis=0)
            self._views[name].learn_background(view, may_be_person(view) | chosen)
        mine = [
            self._gather(share.seen, share.chosen, body.moved_from(times, time_ns))
            for body, share in zip(followed, shares, strict=True)
        ]
        self._looker.begin()
        for body, prior, (points, seen_by) in zip(followed, priors, mine, strict=True):
            body.follow(prior, points, seen_by, time_ns, self._heads)
        if len(followed) > 1:
            self._part_same(followed)
        return shares

    def _shares(
        self, followed: list[FollowedBody], priors: list[Prior], seen: dict[str, ImageClusters]
    ) -> list[Share]:
        bodies = [(body.figure, prior.pose) for body, prior in zip(followed, priors, strict=True)]
        fitter = followed[0].fitter
        if len(bodies) == 1:
            return [share_of_one(self._views, seen, fitter, *bodies[0])]
        return shares_of(self._views, seen, fitter, bodies)

    def _part_same(self, followed: list[FollowedBody]) -> None:
        """Give up the later of two bodies that have lain on each other for some time."""
        for index, body in enumerate(followed):
            lies = any(body.apart_m(other) < _SAME_M for other in followed[:index])
            body.doubled = body.doubled + 1 if lies else 0
            if body.doubled > _SAME_FRAMES:
                body.lose()

    def _gather(
        self,
        seen: dict[str, ImageClusters],
        chosen: dict[str, NDArray[np.bool_]],
        moved: Callable[[str, MeasuredPoints], MeasuredPoints],
    ) -> tuple[MeasuredPoints, dict[str, Silhouette]]:
        """Return the chosen clusters' points, moved to one instant, and their silhouettes by camera."""
        return self._looker.gathered(seen, chosen, POINT_COUNT // max(len(seen), 1), moved)

    # --- beginning

    def _start(self, seen: dict[str, ImageClusters], time_ns: int) -> None:
        """Search for people among the clusters while nobody is followed."""
        self._looker.drop()
        if self._rest == 0 and self._began_touching(seen, time_ns):
            self._looker.begin()
            return
        for name, view in seen.items():
            self._views[name].learn_background(view, may_be_person(view))
        self._looker.begin()
        for body in self.bodies:
            body.lose()
        if self._rest > 0:  # not in every frame after a search without a result
            self._rest -= 1
            return
        for place in candidates(seen, None if self._own_frame else np.zeros(2)):
            if self._began(seen, place, time_ns, _NOBODY_M2):
                return
        self._rest = _REST

    def _began_touching(self, seen: dict[str, ImageClusters], time_ns: int) -> bool:
        """Follow people who touch each other and so form one cluster; return whether there are any."""
        parts = {name: parted(self._views[name], view) for name, view in seen.items()}
        if all(parts[name] is view for name, view in seen.items()):
            return False
        places = []
        for place in candidates(parts, None if self._own_frame else np.zeros(2)):
            points, seen_by = self._points_at(parts, place)
            if len(points.places) >= LEAST_POINTS:
                found = FollowedBody(0, self._views).beginning(points, seen_by, self._heads)
                if found.start.cost_m2 < _NOBODY_NEW_M2 * len(points.places):
                    places.append(place)
        if len(places) < 2:
            return False
        for place in places:
            self._began(parts, place, time_ns, _NOBODY_NEW_M2)
        return any(body.tracked for body in self.bodies)

    def _welcome(self, seen: dict[str, ImageClusters], shares: list[Share], time_ns: int) -> None:
        """Begin to follow people who have come in."""
        followed = [body for body in self.bodies if body.tracked]
        if not followed or len(followed) == MOST_BODIES:
            return
        self._forget(time_ns)
        placed = PlacedBodies.of(followed[0].fitter, [body.placed for body in followed])
        rest = rest_of(self._views, seen, shares, placed)
        awaited = any(not one.tracked and one.since_s(time_ns) < _FORGET_S for one in self.bodies)
        for place in self._newcomers.places(rest, awaited=awaited):
            if not self._began(rest, place, time_ns, _NOBODY_NEW_M2):
                self._newcomers.refuse(place)

    def _forget(self, time_ns: int) -> None:
        """Remove bodies that have been lost for long; the first one's figure stays known."""
        first, *others = self.bodies
        self.bodies = [first, *(one for one in others if one.tracked or one.since_s(time_ns) < _FORGET_S)]

    def _began(self, seen: dict[str, ImageClusters], place: Array, time_ns: int, most_m2: float) -> bool:
        """Follow a person at a place, x and y [m], from now on; return whether there is one.

        Args:
            most_m2: largest residual per point.
        """
        points, seen_by = self._points_at(seen, place)
        if len(points.places) < LEAST_POINTS:
            return False
        body, found = self._best(points, seen_by)
        if found.start.cost_m2 > most_m2 * len(points.places):
            return False
        body.begin(found, time_ns)
        if body not in self.bodies:
            self.bodies.append(body)
        return True

    def _points_at(
        self, seen: dict[str, ImageClusters], place: Array
    ) -> tuple[MeasuredPoints, dict[str, Silhouette]]:
        """Return the points of a person at a place, and their silhouettes by camera."""
        chosen = {name: at_place(view, place) for name, view in seen.items()}
        return self._gather(seen, chosen, lambda _, points: points)

    def _best(
        self, points: MeasuredPoints, seen_by: Mapping[str, Silhouette]
    ) -> tuple[FollowedBody, Beginning]:
        """Return the lost body that explains the points best, or a new one if none of them does."""
        lost = [body for body in self.bodies if not body.tracked]
        if not lost:
            lost = [self._somebody()]
        found = [(body, body.beginning(points, seen_by, self._heads)) for body in lost]
        body, best = min(found, key=lambda one: one[1].start.cost_m2)
        stranger = body.known is not None and best.start.figure is not body.figure
        if stranger and len(self.bodies) > 1:
            body = self._somebody()
        return body, best

    def _somebody(self) -> FollowedBody:
        """Return a new body."""
        return FollowedBody(1 + max(body.number for body in self.bodies), self._views)

    def _in_own_frame(self, skeleton: TrackedSkeleton) -> TrackedSkeleton:
        """Return a skeleton in the frame of the only camera, if the tracker has no transforms."""
        if not self._own_frame or skeleton.status != "tracked":
            return skeleton
        T = next(iter(self._views.values())).T_work_camera
        assert T is not None
        return replace(skeleton, positions=transform_points(invert_transform(T), skeleton.positions))

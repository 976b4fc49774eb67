"""Poses of finished configurations, completed as in the pipeline: hands and head follow, uncertainties are added."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.calibration import Performer
from studio.engine.model.frames import FrameSet, StepResult
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.body import BodySolver
from studio.engine.solve.completion import followed
from studio.engine.solve.uncertainty import of_output_joints
from studio.engine.whole_take.finish.store import Store
from studio.engine.whole_take.finish.windows import MARGIN, WINDOW


class Posing:
    """Makes results from a performer's configurations."""

    def __init__(self, performer: Performer, settings: SolveSettings, skeleton: Skeleton) -> None:
        """Prepare for a performer, their settings and skeleton."""
        self._body = BodySolver(performer, replace(settings, floor_contact="off"))  # finishing applies it
        self._followed = followed.FollowedSmoother(skeleton, settings)

    def results(
        self,
        store: Store,
        q: NDArray[np.float64],
        squared_radii: NDArray[np.float64],
        *,
        lifted_m: float,
        root_height_m: float | None,
    ) -> Iterator[StepResult]:
        """Yield a result for each frame.

        Args:
            store: the take's steps.
            q: configurations, shape (frame_count, nq).
            squared_radii: of the canonical joints' 90 % balls [m2], shape (frame_count, 21).
            lifted_m: how far `q` was raised above what the cameras saw.
            root_height_m: as in `StepResult`.
        """
        up, last_ns = np.array([0.0, 0.0, lifted_m]), None
        parts = self._followed_of(store, q, up)
        for begin in range(0, len(q), WINDOW):
            records = store.read(begin, min(begin + WINDOW, len(q)))
            for k, (frames, fused) in enumerate(store.frames(begin, records), begin):
                dt = 0.0 if last_ns is None else (frames.stage_time_ns - last_ns) * 1e-9
                last_ns = frames.stage_time_ns
                pose = self._body.pose_of(
                    q[k], replace(fused, positions=fused.positions + up), _lifted(frames, up), dt, next(parts)
                )
                sure = of_output_joints(squared_radii[k], fused.confidence)
                yield StepResult(
                    frames, fused, *pose[:2], *sure, configuration=q[k], root_height_m=root_height_m
                )

    def _followed_of(
        self, store: Store, q: NDArray[np.float64], up: NDArray[np.float64]
    ) -> Iterator[followed.Followed | None]:
        """Hands and head frame by frame, smoothed with a second of later frames; None = they are not followed."""
        smoother = self._followed
        if not store.has_parts:
            yield from repeat(None, len(q))
            return
        last_ns, added = int(store.times_ns[0]), 0
        for begin in range(0, len(q), WINDOW):
            end = min(begin + WINDOW, len(q))
            ahead = min(end + MARGIN, len(q))
            for k, (frames, _) in enumerate(store.frames(added, store.read(added, ahead)), added):
                dt, last_ns = (frames.stage_time_ns - last_ns) * 1e-9, frames.stage_time_ns
                self._body.add_to(smoother, q[k], _lifted(frames, up), dt)
            added = ahead
            yield from smoother.smoothed(end - begin)


def _lifted(frames: FrameSet, up: NDArray[np.float64]) -> FrameSet:
    """The cameras' frames, raised with the take."""
    return replace(
        frames,
        positions=frames.positions + up,
        camera_positions=frames.camera_positions + up,
        hand_rays=None if frames.hand_rays is None else frames.hand_rays + up,
        face_rays=None if frames.face_rays is None else frames.face_rays + up,
    )

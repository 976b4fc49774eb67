"""Finishing a take: results of the pipeline come in, in time order, and leave refined, chunk by chunk.

Chunks overlap, and where they do the poses go over from one to the next, so that time and memory grow with the
take's length only as the poses do.
"""

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.body import Body
from studio.engine.calibration.result import Performer
from studio.engine.errors import SettingsError
from studio.engine.finish.contacts import JOINTS, Contacts, find_contacts
from studio.engine.finish.measurements import gather
from studio.engine.finish.smoother import Smoother
from studio.engine.finish.trajectory import Trajectory
from studio.engine.frames import StepResult
from studio.engine.human.model import build_humanoid
from studio.engine.human.skeleton import Skeleton
from studio.engine.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.engine.settings import SolveSettings

CHUNK = 600
OVERLAP = 90
"""Frames solved at once, and how many of them the next chunk solves again."""

ITERATIONS = 3
CONTACT_ITERATIONS = 3
"""Before standing feet are known, and after."""

MAX_SUNK_M = 0.08
"""A take is lifted or let down by this much at most."""

MIN_FRAMES = 6
"""Fewer frames than this on their own (between gaps) are left as they are."""


class Finisher:
    """Refines results; `add` each in time order, then `flush`."""

    def __init__(self, performer: Performer, settings: SolveSettings) -> None:
        """Prepare for a performer.

        Raises:
            SettingsError: `ik=none` leaves nothing to refine.
        """
        if settings.ik == "none":
            raise SettingsError(
                "finish=on needs a solved pose; allowed with it: ik=previous_pose, combined_skeleton"
            )
        limited = settings.human_limits == "on"
        self._humanoid = build_humanoid(
            Skeleton.of(performer), human_limits=limited, flexibility=settings.flexibility
        )
        self._dt = 1.0 / settings.output_hz
        self._smoother = Smoother(self._humanoid, self._dt, limited=limited)
        self._contacts = settings.floor_contact == "on"
        rest = self._humanoid.skeleton.rest_positions_m
        self._rest_heights_m = rest[OUTPUT_OF_CANONICAL_INDEX[list(JOINTS)], 2]
        self._body = Body(performer, settings)
        self._waiting: list[StepResult] = []
        self._tail: NDArray[np.float64] | None = None  # configurations of the overlap, by the chunk before
        self._last_ns: int | None = None
        self._lifted_m = 0.0

    def add(self, result: StepResult) -> list[StepResult]:
        """Take in a result; return those that are finished, in time order."""
        done: list[StepResult] = []
        if self._waiting:
            step_s = (result.frame_set.stage_time_ns - self._waiting[-1].frame_set.stage_time_ns) * 1e-9
            if step_s > 1.5 * self._dt:
                done = self.flush()
        self._waiting.append(replace(result, fused=replace(result.fused, reasons={})))
        if len(self._waiting) == CHUNK:
            done += self._finish(CHUNK - OVERLAP)
        return done

    def flush(self) -> list[StepResult]:
        """Return all that is still waiting, finished."""
        return self._finish(len(self._waiting))

    def _finish(self, count: int) -> list[StepResult]:
        """Solve all that waits at once; hand out the first `count`."""
        q = self._refined()
        if self._tail is not None:
            self._go_over(q)
        done = [self._posed(result, row) for result, row in zip(self._waiting[:count], q, strict=False)]
        self._tail = q[count:] if count < len(q) else None
        self._waiting = self._waiting[count:]
        return done

    def _refined(self) -> NDArray[np.float64]:
        trajectory = Trajectory(self._humanoid, np.array([r.configuration for r in self._waiting]))
        if len(self._waiting) >= MIN_FRAMES:
            measurements = gather([r.frame_set for r in self._waiting], trajectory.sites())
            self._smoother.refine(trajectory, measurements, None, ITERATIONS)
            if self._contacts:
                contacts = find_contacts(trajectory.sites(), self._dt)
                self._smoother.refine(trajectory, measurements, contacts, CONTACT_ITERATIONS)
                self._lifted_m = self._sunk_m(contacts)
                trajectory.q[:, 2] += self._lifted_m
        return trajectory.q

    def _sunk_m(self, contacts: Contacts) -> float:
        """How far the floor has to come up for standing feet to be at their resting heights [m].

        The floor was calibrated from another walk: a centimetre or more off. The take's own standing feet know
        better, and a whole take that is lifted or let down keeps its motion.
        """
        off = self._rest_heights_m - contacts.height_m
        off = off[np.isfinite(off)]
        return float(np.clip(np.median(off), -MAX_SUNK_M, MAX_SUNK_M)) if len(off) else 0.0

    def _go_over(self, q: NDArray[np.float64]) -> None:
        """Go from the chunk before to this one over the middle third of the overlap, in place."""
        assert self._tail is not None
        model, difference = self._humanoid.model, np.empty(self._humanoid.model.nv)
        overlap = min(len(self._tail), len(q))
        share = np.clip(3.0 * (np.arange(overlap) + 0.5) / overlap - 1.0, 0.0, 1.0)
        for k in range(overlap):
            here = self._tail[k].copy()
            mujoco.mj_differentiatePos(model, difference, 1.0, here, q[k])
            mujoco.mj_integratePos(model, here, difference, share[k])
            q[k] = here

    def _posed(self, result: StepResult, q: NDArray[np.float64]) -> StepResult:
        """The result with the pose of a refined configuration, completed as the pipeline does."""
        now = result.frame_set.stage_time_ns
        dt = 0.0 if self._last_ns is None else (now - self._last_ns) * 1e-9
        self._last_ns = now
        up = np.array([0.0, 0.0, self._lifted_m])
        fused = replace(result.fused, positions=result.fused.positions + up)
        frames = replace(
            result.frame_set,
            positions=result.frame_set.positions + up,
            camera_positions=result.frame_set.camera_positions + up,
        )
        pose = self._body.pose_of(q, fused, frames, dt)
        return StepResult(result.frame_set, result.fused, *pose, configuration=q)

"""The humanoid solved by an iterated extended Kalman filter over its degrees of freedom (steps 5 and 7)."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import FrameSet, FusedSkeleton, Pinned, Reading
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import FREE_DOFS, Humanoid
from studio.engine.model.human.kinematics import SiteKinematics
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT, MIRROR
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.fusion.facing import WRONG, Facing, forwardness
from studio.engine.solve.fusion.robust import RobustFusion
from studio.engine.solve.ik.effectors import pull_scale, resist_scale
from studio.engine.solve.ik.reseed import LimbReseed
from studio.engine.solve.ik.solver import Solver
from studio.engine.solve.ik.swing import swing_rotations
from studio.engine.solve.kalman.belief import Belief, acceleration_density
from studio.engine.solve.kalman.correction import Correction
from studio.engine.solve.kalman.feet import StandingFeet
from studio.engine.solve.kalman.kernels import shown
from studio.engine.solve.kalman.readings import Gate, ReadingRows
from studio.engine.solve.kalman.sides import ways_of_sides
from studio.engine.solve.touching import TouchingNow

Array = NDArray[np.float64]

SHARE_CHANGED = 0.3
"""A correction is iterated again if it changes the weight of a row by more than this (`readings`)."""

FACING_S = 0.1
"""Interval between checks of the body's facing."""

FORGET_S = 0.5
"""The filter restarts after this long without a joint."""

NO_BODY_M, DOUBTED_S = 0.05, 0.5
"""Joints placed by rays are rejected if half of them are further than this from any pose, for at most this long."""

CLEARLY = 0.7
"""Left and right are exchanged in some cameras if that reduces the joints' distance from a pose to this share."""

PIN_STEPS, PIN_NEAR_M = 3, 0.002
"""Most corrections by a known joint, and distance from its place below which no other follows [m]."""

PIN_TURNS, PIN_TURN_RAD = 12, 0.5
"""Most corrections of the output pose, and the furthest that one turns a hinge: a limb that has to stretch does not
fold."""

LONGEST_S = 0.2
"""Longest prediction in one step [s]."""

REJECTED_PLACE, REJECTED_SPEED = 0.3, 3.0
"""Uncertainty added to a limb that was restarted, or whose joint is accepted again [rad], [rad/s]."""

_LIMB_HINGES = 8


class BodyFilter:
    """Solves the pose from cameras' joints, or from fused ones, frame by frame.

    With cameras' joints the state is ahead of the output: a pose is output once the joints after it are known.
    """

    def __init__(self, humanoid: Humanoid, settings: SolveSettings) -> None:
        self.humanoid = humanoid
        self._settings = settings
        self._limited = settings.human_limits == "on"
        hinges = len(humanoid.range_rad)
        ends = humanoid.range_rad.T if self._limited else np.outer([-1.0, 1.0], np.full(hinges, np.inf))
        self._low, self._high = ends
        self._belief = Belief(
            humanoid, acceleration_density(resist_scale(humanoid, settings.effectors)), *ends
        )
        self._kinematics = SiteKinematics(humanoid)
        usual = SolveSettings().effectors
        self._reach = np.array([settings.effectors[name].reach / usual[name].reach for name in CANONICAL])
        pull = pull_scale(humanoid, settings.effectors)
        self._pull = None if pull is None else np.repeat(pull, 3, axis=0)
        self._gate = Gate(self._reach)
        self._feet = StandingFeet(humanoid, *ends) if settings.floor_contact == "on" else None
        self._watch = LimbReseed(humanoid, limited=self._limited)
        self._facing = Facing()
        self._contact = TouchingNow(humanoid.skeleton.height_m)
        self._waiting: list[Reading] = []
        self._used = np.zeros((0, JOINT_COUNT), dtype=bool)
        self._sites = np.full((JOINT_COUNT, 3), np.nan)
        self._since_rows_s, self._unwatched_s = 0.0, 0.0
        self._lost = False
        self._started = False
        self._doubted_s = 0.0
        self._ahead_s = settings.ahead_ns * 1e-9

    @property
    def floor_m(self) -> float:
        """Height of the floor that the feet stand on [m]."""
        return 0.0 if self._feet is None else self._feet.floor_m

    def stand_beside(self, other: "BodyFilter") -> None:
        """Use the floor that another performer's feet find."""
        if self._feet is not None:
            self._feet.beside = other._feet

    def follow(self, frames: FrameSet, dt: float) -> tuple[FusedSkeleton, Array | None]:
        """Return the cameras' joints that were used, fused, and the configuration, shape (nq,).

        The configuration is None until the trunk's joints have been seen once.

        Args:
            frames: with the readings since the last.
            dt: time since the last frame [s].
        """
        if len(self._used) != len(frames.cameras):
            self._used = np.zeros((len(frames.cameras), JOINT_COUNT), dtype=bool)
        starts = self._needs_start(bool(frames.readings), dt)
        fused = None
        if starts:
            fused = self._of_rays(frames, dt) if frames.rays.any() else RobustFusion().fuse(frames)
        if fused is not None:
            if self._begin(fused.positions, fused.sigma):
                self._used = fused.used.copy()
        elif self._started:
            ahead = [replace(r, offset_s=r.offset_s - self._ahead_s) for r in frames.readings]
            self._advance(ahead, frames.camera_positions, dt)
            if _is_told(frames):
                self._pin(self._known(frames, self._sites))
        if not self._started:
            return self._fused(frames), None
        q, velocity, place = self._belief.earlier()
        q = self._shown_of(q, velocity, place, dt, frames.stands)
        if _is_told(frames):
            self._put_on_pins(q, place, self._known(frames, self._kinematics.place(q).copy()))
        return self._fused(frames), q

    def solve(self, joints: Array, sigma: Array, dt: float) -> Array | None:
        """Return the configuration solved for fused joints, shape (nq,); None until the trunk has been seen.

        Args:
            joints: canonical joints [m], shape (21, 3), stage frame; NaN = unseen.
            sigma: their standard deviation [m], shape (21,); ignored where unseen.
            dt: time since the last frame [s].
        """
        seen = np.isfinite(joints[:, 0])
        if self._needs_start(bool(seen.any()), dt):
            self._begin(joints, sigma)
        elif self._started:
            self._predict(dt)
            if seen.any():
                information = np.where(seen, sigma, 1.0)[:, None, None] ** -2 * np.eye(3)
                rows = ReadingRows(joints[None], information[None], self._reach)
                q = self._belief.q.copy()
                watched = joints, np.where(seen, 1.0 / np.where(seen, sigma, 1.0), 0.0) * self._reach
                self._correct(rows, 0.0, q, *self._linearised(q), watched=watched)
        if not self._started:
            return None
        return self._shown_of(self._belief.q.copy(), self._belief.velocity, self._belief.place, dt)

    def _needs_start(self, shown: bool, dt: float) -> bool:
        """Whether to start now: joints are shown, and the state is missing, too old or lost."""
        late = self._since_rows_s + dt > FORGET_S
        return shown and (not self._started or late or self._lost)

    def _of_rays(self, frames: FrameSet, dt: float) -> FusedSkeleton | None:
        """Return the performer's joints from rays at the start of a solve; None where they show none yet.

        If left and right differ between cameras, the rays meet in no human shape. They are exchanged in those cameras
        for which a pose then fits best. Feet and knees then distinguish the body from its mirror image. After
        `DOUBTED_S` any result is taken.
        """
        self._doubted_s += dt
        found = [(self._off_body(fused), fused) for fused in ways_of_sides(frames)]
        off, fused = found[0]
        best = min(found, key=lambda one: one[0])
        if best[0] < CLEARLY * off:
            off, fused = best
        if off == np.inf:
            return None
        if off > NO_BODY_M and self._doubted_s < DOUBTED_S:
            return None
        self._doubted_s = 0.0
        if forwardness(fused.positions) < WRONG:
            return replace(fused, positions=fused.positions[MIRROR], sigma=fused.sigma[MIRROR])
        return fused

    def _off_body(self, fused: FusedSkeleton) -> float:
        """Median distance of the joints from the pose that fits them [m]; infinite where the trunk is unseen."""
        q = Solver(self.humanoid, self._settings).solve(fused.positions, fused.sigma, 0.0)
        if q is None:
            return np.inf
        return float(np.nanmedian(np.linalg.norm(self._kinematics.place(q) - fused.positions, axis=1)))

    def _begin(self, joints: Array, sigma: Array) -> bool:
        """Restart from joints; return False where the trunk is unseen."""
        q = Solver(self.humanoid, self._settings).solve(joints, sigma, 0.0)
        if q is None:
            return False
        self._belief.begin(q)
        self._sites = self._kinematics.place(q).copy()
        self._gate.forget()
        self._waiting = []
        self._watch.forget()
        if self._feet is not None:
            self._feet.forget()
        self._started, self._since_rows_s, self._lost = True, 0.0, False
        return True

    def _advance(self, readings: Sequence[Reading], camera_positions: Array, dt: float) -> None:
        """Predict the output frame, and correct by the cameras' readings around it."""
        self._predict(dt)
        readings = self._due(readings, len(camera_positions), dt)
        if not readings:
            return
        late_s = float(np.mean([r.offset_s for r in readings]))
        q = self._belief.moved(late_s)
        sites, jacobian = self._linearised(q)
        velocities = (jacobian @ self._belief.velocity).reshape(-1, 3)
        rows = self._gate.rows(readings, camera_positions, sites, velocities, late_s)
        if self._turned_round(rows, dt):
            return
        cameras = np.array([r.camera for r in readings])
        self._correct(rows, late_s, q, sites, jacobian)
        self._used[cameras] = rows.used

    def _due(self, readings: Sequence[Reading], cameras: int, dt: float) -> list[Reading]:
        """Return the readings to correct by now. While all readings are ahead of the output frame, they wait for the
        other cameras', so that one correction covers all.
        """
        waiting = [replace(r, offset_s=r.offset_s - dt) for r in self._waiting]
        self._waiting = [*waiting, *readings]
        ahead = all(r.offset_s >= 0.9 * dt for r in self._waiting)
        if ahead and len({r.camera for r in self._waiting}) < cameras:
            return []
        due, self._waiting = self._waiting, []
        return due

    def _turned_round(self, rows: ReadingRows, dt: float) -> bool:
        """Restart with left and right exchanged, if the cameras' joints have faced backwards for a while. The check
        uses the measured joints, because the body's own feet cannot point backwards.
        """
        self._unwatched_s += dt
        if self._unwatched_s < FACING_S:
            return False
        reported = rows.middle()[0]
        backwards = self._facing.backwards(reported, self._unwatched_s)
        self._unwatched_s = 0.0
        if not backwards:
            return False
        return self._begin(
            np.where(np.isnan(reported), self._sites, reported)[MIRROR], np.full(JOINT_COUNT, 0.03)
        )

    def _predict(self, dt: float) -> None:
        self._since_rows_s += dt
        self._belief.predict(min(dt, LONGEST_S))

    def _correct(
        self,
        rows: ReadingRows,
        late_s: float,
        q: Array,
        sites: Array,
        jacobian: Array,
        *,
        watched: tuple[Array, Array] | None = None,
    ) -> None:
        """Correct the state by rows of the configuration `q`, `late_s` [s] after the output frame.

        `watched`: joints, and 1 / their standard deviations, for the detection of stuck limbs; None = the used rows.
        """
        belief, elapsed = self._belief, self._since_rows_s
        self._since_rows_s = 0.0
        correction = Correction(*belief.toward(late_s), late_s, jacobian)
        self._choose(rows, sites, jacobian, correction.spread, elapsed)
        if not rows.used.any():
            return
        room = np.stack([self._high - q[7:], self._low - q[7:]])
        information, pull, share = rows.pull(sites)
        correction.solve(information, pull, room)
        information, pull, share_now = rows.pull(sites + correction.moved)
        if correction.beyond or np.abs(share_now - share).max() > SHARE_CHANGED:
            correction.solve(information, pull, room)
        step = correction.step()
        belief.correct(step, correction.told(), correction.gained())
        self._sites = self._kinematics.place(belief.moved(late_s)).copy()
        self._unstick(*(rows.middle() if watched is None else watched), elapsed)

    def _known(self, frames: FrameSet, sites: Array) -> Pinned:
        """Known joints in the output frame, over the floor that was found: pinned ones, and those that touch.
        `sites`: the body's joints."""
        pinned = None if frames.pinned is None else frames.pinned.raised(self.floor_m)
        return self._contact.known(pinned, frames.touches, sites, self.floor_m)

    def _pin(self, pinned: Pinned) -> None:
        """Correct the state by joints that are known in the output frame, whatever the cameras say."""
        belief, late_s = self._belief, -self._ahead_s
        for _ in range(PIN_STEPS):
            q = belief.moved(late_s)
            sites, jacobian = self._linearised(q)
            told, away = pinned.rows(sites)
            if not told.any() or np.abs(away).max() < PIN_NEAR_M:
                return
            jacobian = pinned.moving(sites, jacobian)
            correction = Correction(*belief.toward(late_s), late_s, jacobian)
            room = np.stack([self._high - q[7:], self._low - q[7:]])
            information, pull = told[:, None, None] * np.eye(3), told[:, None] * away
            correction.solve(information, pull, room)
            if correction.beyond:
                correction.solve(information, pull, room)
            belief.correct(correction.step(), correction.told(), correction.gained())
        self._sites = self._kinematics.place(belief.q).copy()

    def _put_on_pins(self, q: Array, place: Array, pinned: Pinned) -> None:
        """Move the output configuration's joints to where they are known to be, in place; `place`: its covariance."""
        for _ in range(PIN_TURNS):
            sites, jacobian = self._linearised(q)
            told, away = pinned.rows(sites)
            rows = np.flatnonzero(np.repeat(told > 0.0, 3))
            if not len(rows) or np.abs(away[told > 0.0]).max() < PIN_NEAR_M:
                return
            own = pinned.moving(sites, jacobian)[rows]
            spread = place @ own.T
            total = own @ spread
            total.flat[:: len(total) + 1] += 1.0 / np.repeat(told, 3)[rows]
            step = spread @ np.linalg.solve(total, away.ravel()[rows])
            step *= min(1.0, PIN_TURN_RAD / max(float(np.abs(step[FREE_DOFS:]).max()), 1e-9))
            mujoco.mj_integratePos(self.humanoid.model, q, step, 1.0)
            np.clip(q[7:], self._low, self._high, out=q[7:])

    def _choose(
        self,
        rows: ReadingRows,
        sites: Array,
        jacobian: Array,
        spread: Callable[[], Array],
        elapsed: float,
    ) -> None:
        """Reject outlier rows, and detect a performer who is elsewhere."""
        again = self._gate.choose(rows, sites, spread, elapsed)
        for joint in np.flatnonzero(again):
            moving = np.abs(jacobian[3 * joint : 3 * joint + 3]).max(axis=0) > 0.0
            limb = np.flatnonzero(moving)[FREE_DOFS:][-_LIMB_HINGES:]
            self._belief.doubt(limb, REJECTED_PLACE, REJECTED_SPEED)
        self._lost = self._gate.lost(np.logical_or.reduce(rows.seen, axis=0))

    def _linearised(self, q: Array) -> tuple[Array, Array]:
        sites, jacobian = self._kinematics.linearise(q)
        return sites, jacobian if self._pull is None else jacobian * self._pull

    def _unstick(self, targets: Array, weights: Array, elapsed: float) -> None:
        """Restart a stuck limb."""
        found = self._watch.found(
            self._belief.q, self._sites, targets, weights, lambda: self._shown(targets), elapsed
        )
        if found is not None:
            q, hinges = found
            self._belief.put(q, hinges)
            self._belief.doubt(FREE_DOFS + hinges, REJECTED_PLACE, REJECTED_SPEED)

    def _shown(self, joints: Array) -> Array | None:
        """The configuration read from the joints' directions, or None where the trunk is unseen."""
        rotations = swing_rotations(self.humanoid.skeleton, joints)
        if rotations is None or not np.isfinite(joints[INDEX["hips"]]).all():
            return None
        return configuration_of(self.humanoid, joints[INDEX["hips"]], rotations, limited=self._limited)

    def _shown_of(
        self, q: Array, velocity: Array, place: Array, dt: float, stands: NDArray[np.int8] | None = None
    ) -> Array:
        """The output configuration: standing feet held, restarted limbs blended."""
        q = self._watch.led(q, dt)
        return q if self._feet is None else self._feet.held(q, velocity, place, dt, stands)

    def _fused(self, frames: FrameSet) -> FusedSkeleton:
        """The cameras' used joints at the output frame, fused."""
        exchanged = (
            self._gate.exchanged if len(self._gate.exchanged) else np.zeros(len(self._used), dtype=bool)
        )
        if frames.rays.any():
            exchanged = exchanged & ~frames.rays  # their frame set has left and right as they are
        mean, sure, seen, used = shown(frames.positions, frames.confidence, self._used, exchanged, MIRROR)
        known = ~np.isnan(mean[:, 0])
        reasons = {
            (int(c), int(k)): ("disagrees" if known[k] else "outlier") if seen[c, k] else "unseen"
            for c, k in zip(*np.nonzero(~used), strict=True)
        }
        return FusedSkeleton(mean, sure, np.where(known, 0.03, np.nan), used, reasons)


def _is_told(frames: FrameSet) -> bool:
    """Whether an operator has set places of joints."""
    return frames.pinned is not None or bool(frames.touches)

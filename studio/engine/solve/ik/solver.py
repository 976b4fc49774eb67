"""One frame of the humanoid, solved for the fused joints by mink's differential inverse kinematics (step 7).

`previous_pose`: the solve starts from the last pose, extrapolated by its velocity, and is pulled by the joints.
`combined_skeleton`: it starts from the pose shown by the joints' directions (`swing`), and only corrects it.
"""

from collections.abc import Callable
from typing import Any, cast

import mink
import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.joints import CANONICAL, INDEX
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.ik.box_qp import UNBOUNDED, BoxQP
from studio.engine.solve.ik.effectors import pull_scale, resist_scale
from studio.engine.solve.ik.reseed import LimbReseed
from studio.engine.solve.ik.swing import ShownHinges, swing_rotations
from studio.engine.solve.ik.tasks import HingeLimit, JointPositionsTask, MotionPriorTask
from studio.engine.solve.ik.twist import LimbTwists

_build_ik = cast("Callable[..., Any]", mink.build_ik)
"""Typed as if the matrix could be sparse; mink's is always dense."""

ITERATIONS = 2
"""Iterations per frame. The second cuts the lag of fast motion; a third has no effect."""

FIRST_ITERATIONS = 12
"""Iterations of a first frame, or after the performer was lost."""

MAX_STEP_RAD = 0.6
"""Largest turn of a hinge per iteration; the linear model does not hold beyond it."""

MODEL_SIGMA_M = 0.01
"""Deviation of a real joint centre from a rigid body's [m]; added to the joints' own deviation."""

VELOCITY_SHARE = 0.8
"""Share of the last frame's velocity that is kept."""

DAMPING = 1e-3

# Standard deviation of each hinge from its extrapolation, per second of time [rad/s], by output joint; the
# free hips come first, as [m/s] and [rad/s].
_HIPS_SIGMA = (1.5, 1.5, 1.5, 3.0, 3.0, 3.0)
_SIGMA = {
    "Spine": 3.5, "Spine1": 3.5, "Spine2": 3.5, "Neck": 7.5, "Head": 7.5, "Shoulder": 4.5, "Arm": 18.0,
    "ForeArm": 21.0, "Hand": 12.0, "UpLeg": 15.0, "Leg": 18.0, "Foot": 12.0, "ToeBase": 9.0,
}  # fmt: skip

REST_WEIGHT = 0.4
"""Weight of the pull to the resting stance, in units of each hinge's usual spread, for hinges that no joint shows."""

JUMP_M_S = 7.0
"""A joint jumps if it is further from its prediction than this speed allows."""

JUMPING_S = 0.1
"""Jumps are blended in for at most this time; longer ones are fast motion and are followed [s]."""

EASE_S = 0.05
"""Time constant of the blend to a joint that jumped [s]."""

MAX_CARRY_S = 0.05
"""Longest extrapolation of a pose by its velocity."""

LOST_M = 0.35
"""The solve restarts if the trunk joints are further than this from the last pose."""

FAR_M = 100.0
"""A joint further than this from the stage's origin, along any axis, is an error and counts as unseen."""

CARRY_S = 0.2
"""A pose's velocity is used for at most this time."""

HELD_FREEDOM = 0.25
"""A hinge below this freedom, because its joint resists, is not moved by the restart of a limb."""

_TRUNK = np.array(
    [INDEX[n] for n in ("hips", "chest", "neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")]
)


def _hinge_values(table: dict[str, float]) -> NDArray[np.float64]:
    values = [
        table[name.removeprefix("Left").removeprefix("Right")]
        for name in BODY_JOINTS[1:]
        for _ in dofs_of(name)
    ]
    return np.array(values)


class Solver:
    """Solves the humanoid for fused joints, frame by frame."""

    def __init__(self, humanoid: Humanoid, settings: SolveSettings) -> None:
        self.humanoid = humanoid
        model = humanoid.model
        self._combined = settings.ik == "combined_skeleton"
        self._limited = settings.human_limits == "on"
        self._configuration = mink.Configuration(model, humanoid.rest_qpos)
        self._task = JointPositionsTask(humanoid, pull_scale(humanoid, settings.effectors))
        self._prior = MotionPriorTask(humanoid)
        self._limit = HingeLimit(humanoid, MAX_STEP_RAD, limited=self._limited)
        self._qp = BoxQP(model.nv)
        self._low, self._high = np.full(model.nv, -UNBOUNDED), np.full(model.nv, UNBOUNDED)
        freedom = resist_scale(humanoid, settings.effectors)
        held = freedom[FREE_DOFS:] < HELD_FREEDOM
        self._watch = None if self._combined else LimbReseed(humanoid, limited=self._limited, held=held)
        self._reach = np.array([settings.effectors[name].reach for name in CANONICAL])
        self._let_be = (self._reach == 0.0) & ~np.isin(np.arange(len(CANONICAL)), _TRUNK)
        sigma = np.concatenate([_HIPS_SIGMA, _hinge_values(_SIGMA)])
        self._stiffness = 1.0 / (sigma * freedom) ** 2
        self._twists = LimbTwists(humanoid)
        self._shows = ShownHinges(humanoid)
        self._rest_stiffness = 1.0 / humanoid.spread_rad**2
        self._velocity = np.zeros(model.nv)
        self._offset = np.zeros((len(CANONICAL), 3))
        self._offset_left = False
        self._last_joints = np.full((len(CANONICAL), 3), np.nan)
        self._jumping_s = np.zeros(len(CANONICAL))
        self._started = False

    def solve(
        self, joints: NDArray[np.float64], sigma: NDArray[np.float64], dt: float
    ) -> NDArray[np.float64] | None:
        """Return the configuration solved for the joints, shape (nq,).

        Args:
            joints: canonical joints [m], shape (21, 3), stage frame; NaN, or beyond `FAR_M`, = unseen.
            sigma: their standard deviation [m], shape (21,); ignored where unseen.
            dt: time since the last frame [s].

        Returns:
            None until the trunk's joints have been seen once.
        """
        seen = np.logical_and.reduce(np.abs(joints) < FAR_M, axis=1)
        if not seen.all():
            joints = np.where(seen[:, None], joints, np.nan)
        if not self._started or self._lost(joints):
            found = self._start(joints, np.where(seen, 0.03, np.nan))
            self._started = self._started or found  # once started, a lost pose continues from its place
            if not self._started:
                return None
        before = self._configuration.q
        guess = self._guess(joints, before, dt)
        self._configuration.update(guess)
        targets = self._eased(joints, dt)
        weights = np.where(seen, self._reach, 0.0) / np.hypot(np.where(seen, sigma, 1.0), MODEL_SIGMA_M)
        self._task.set_targets(targets, weights)
        self._prior.predicted = guess
        self._prior.stiffness = self._stiffness / max(dt, 1e-3) ** 2
        if not self._combined:
            self._prior.stiffness[self._twists.dofs] /= self._twists.freedom(before) ** 2
        self._prior.rest_stiffness = REST_WEIGHT * self._rest_stiffness
        self._iterate(ITERATIONS)
        after = self._configuration.q
        if dt > 0:
            mujoco.mj_differentiatePos(self.humanoid.model, self._velocity, dt, before, after)
        return after if self._watch is None else self._unstuck(self._watch, joints, targets, weights, dt)

    def _unstuck(
        self,
        watch: LimbReseed,
        joints: NDArray[np.float64],
        targets: NDArray[np.float64],
        weights: NDArray[np.float64],
        dt: float,
    ) -> NDArray[np.float64]:
        """The output configuration, with stuck limbs restarted."""
        q = self._configuration.q
        sites = self._configuration.data.site_xpos[self.humanoid.site_ids]
        found = watch.found(q, sites, targets, weights, lambda: self._shown(joints, q), dt)
        if found is not None:
            q, hinges = found
            self._configuration.update(q)
            self._velocity[FREE_DOFS + hinges] = 0.0
        return watch.led(q, dt).copy()

    def _eased(self, joints: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """The joints, with jumps blended in over `EASE_S`. A joint that jumps for longer than `JUMPING_S` is fast,
        and is followed.
        """
        if self._combined:
            return joints
        expected = self._configuration.data.site_xpos.take(self.humanoid.site_ids, axis=0)
        if self._offset_left:
            self._offset *= np.exp(-dt / EASE_S)
        reach2 = (JUMP_M_S * max(dt, 1e-3)) ** 2
        off, moved = joints + self._offset - expected, joints - self._last_joints
        away = np.vecdot(off, off) > reach2  # False where unseen
        if away.any():
            jumped = away & ~(np.vecdot(moved, moved) < reach2)  # the second is True where it was unseen
            self._jumping_s = np.where(jumped, self._jumping_s + dt, 0.0)
            jumped &= self._jumping_s < JUMPING_S
            self._offset[jumped] = (expected - joints)[jumped]
            self._offset_left = self._offset_left or bool(jumped.any())
        else:
            self._jumping_s[:] = 0.0
        self._last_joints = joints
        return joints + self._offset

    def _lost(self, joints: NDArray[np.float64]) -> bool:
        apart = joints[_TRUNK] - self._configuration.data.site_xpos.take(
            self.humanoid.site_ids[_TRUNK], axis=0
        )
        squared = sorted(
            value for value in np.vecdot(apart, apart).tolist() if value == value
        )  # NaN is not itself
        return len(squared) > 2 and squared[(len(squared) - 1) // 2] > LOST_M**2

    def _guess(
        self, joints: NDArray[np.float64], before: NDArray[np.float64], dt: float
    ) -> NDArray[np.float64]:
        """The start of the iterations, and the pose that they are pulled to."""
        if self._combined:
            shown = self._shown(joints, before)
            if shown is not None:
                return shown
        guess = before.copy()
        velocity = VELOCITY_SHARE * self._velocity
        velocity[self._twists.dofs] *= self._twists.freedom(before)
        mujoco.mj_integratePos(self.humanoid.model, guess, velocity, min(dt, CARRY_S))
        if self._limited:
            low, high = self.humanoid.range_rad.T
            np.minimum(np.maximum(guess[7:], low), high, out=guess[7:])
        return guess

    def _shown(self, joints: NDArray[np.float64], unseen: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The configuration read from the joints' directions; hinges that they do not show are those of `unseen`.
        None where the trunk is unseen.
        """
        if self._let_be.any():
            joints = np.where(self._let_be[:, None], np.nan, joints)
        rotations = swing_rotations(self.humanoid.skeleton, joints)
        if rotations is None or not np.isfinite(joints[INDEX["hips"]]).all():
            return None
        q = configuration_of(self.humanoid, joints[INDEX["hips"]], rotations, limited=self._limited)
        hidden = 7 + np.flatnonzero(~self._shows.shown(joints))
        q[hidden] = unseen[hidden]
        return q

    def _start(self, joints: NDArray[np.float64], sigma: NDArray[np.float64]) -> bool:
        """Find a first pose from the joints alone; return False where the trunk is unseen."""
        shown = self._shown(joints, self.humanoid.rest_qpos)
        if shown is None:
            return False
        seen = np.isfinite(joints[:, 0])
        weights = np.zeros(len(seen))
        weights[seen] = self._reach[seen] / sigma[seen]
        self._task.set_targets(joints, weights)
        self._prior.predicted = shown
        self._prior.stiffness = np.full(self.humanoid.model.nv, 1.0)
        self._prior.rest_stiffness = self._rest_stiffness
        self._configuration.update(shown)
        self._iterate(FIRST_ITERATIONS)
        self._velocity[:] = 0.0
        self._offset[:], self._offset_left = 0.0, False
        if self._watch is not None:
            self._watch.forget()
            self._settle(self._watch, joints, weights)
        self._last_joints = joints
        self._jumping_s[:] = 0.0
        return True

    def _settle(self, watch: LimbReseed, joints: NDArray[np.float64], weights: NDArray[np.float64]) -> None:
        """Restart the stuck limbs of a first pose: an arm may be caught at the wrong end of its ranges."""
        q = self._configuration.q
        sites = self._configuration.data.site_xpos[self.humanoid.site_ids]
        found = watch.settled(q, sites, joints, weights, lambda: self._shown(joints, q))
        if found is not None:
            self._configuration.update(found)
            self._prior.predicted = found
            self._iterate(FIRST_ITERATIONS)

    def _iterate(self, count: int) -> None:
        """Minimise the tasks within the limits, by `count` steps of mink's problem."""
        tasks, hinges = [self._task, self._prior], self.humanoid.model.nv - FREE_DOFS
        for _ in range(count):
            problem = _build_ik(self._configuration, tasks, 1.0, DAMPING, limits=[])
            ends = self._limit.room(self._configuration)
            self._high[FREE_DOFS:] = ends[:hinges]
            np.negative(ends[hinges:], out=self._low[FREE_DOFS:])
            step = self._qp.solve(problem.P, problem.q, self._low, self._high)
            self._configuration.integrate_inplace(step, 1.0)

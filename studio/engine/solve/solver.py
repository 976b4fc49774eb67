"""One frame of the humanoid following the fused joints, by mink's differential inverse kinematics (step 7).

`previous_pose`: the solve starts from the last pose, carried on by its velocity, and joints pull it on.
`combined_skeleton`: it starts from the pose that the joints themselves show (`swing`), and only corrects it.
"""

import mink
import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.human.ranges import dofs_of
from studio.engine.joints import CANONICAL, INDEX, OUTPUT_OF_CANONICAL
from studio.engine.settings import SolveSettings
from studio.engine.solve.angles import configuration_of
from studio.engine.solve.reseed import LimbWatch
from studio.engine.solve.swing import swing_rotations
from studio.engine.solve.tasks import HingeLimit, JointPositionsTask, MotionPriorTask

ITERATIONS = 2
"""Per frame; the second cuts the lag of fast motion, a third gives nothing."""

FIRST_ITERATIONS = 12
"""For a first frame, or where the performer is found again."""

MAX_STEP_RAD = 0.6
"""Longest turn of a hinge in an iteration: beyond it the linear model of the pose is not worth following."""

MODEL_SIGMA_M = 0.01
"""How far a real joint centre strays from a rigid body's [m]; added to the joints' own deviation."""

VELOCITY_SHARE = 0.8
"""How much of the last frame's velocity carries on."""

DAMPING = 1e-3

# Deviation of each hinge from where its velocity carries it, per second of time [rad/s], by output joint; the
# free hips come first, as [m/s] and [rad/s].
_HIPS_SIGMA = (1.5, 1.5, 1.5, 3.0, 3.0, 3.0)
_SIGMA = {
    "Spine": 3.5, "Spine1": 3.5, "Spine2": 3.5, "Neck": 7.5, "Head": 7.5, "Shoulder": 4.5, "Arm": 18.0,
    "ForeArm": 21.0, "Hand": 12.0, "UpLeg": 15.0, "Leg": 18.0, "Foot": 12.0, "ToeBase": 9.0,
}  # fmt: skip

REST_WEIGHT = 0.4
"""Pull to the resting stance, in units of each hinge's usual spread: it settles what no joint shows."""

JUMP_M_S = 7.0
"""A joint off its expected place by more than this speed explains has turned up elsewhere."""

EASE_S = 0.05
"""Time constant with which the pose follows a joint that turned up elsewhere [s]."""

MAX_CARRY_S = 0.05
"""A pose is carried on by its velocity for this long at most."""

LOST_M = 0.35
"""Trunk joints further than this from the last pose mean another place: the solve starts anew."""

FAR_M = 100.0
"""A joint further than this from the stage's origin, along any axis, is an error: it counts as unseen."""

CARRY_S = 0.2
"""A pose's velocity carries it on for no longer than this."""

_TRUNK = [
    INDEX[n] for n in ("hips", "chest", "neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
]


def _hinge_values(table: dict[str, float]) -> NDArray[np.float64]:
    values = [
        table[name.removeprefix("Left").removeprefix("Right")]
        for name in BODY_JOINTS[1:]
        for _ in dofs_of(name)
    ]
    return np.array(values)


class Solver:
    """Follows fused joints with the humanoid, frame by frame."""

    def __init__(self, humanoid: Humanoid, settings: SolveSettings) -> None:
        self.humanoid = humanoid
        self._combined = settings.ik == "combined_skeleton"
        self._configuration = mink.Configuration(humanoid.model, humanoid.rest_qpos)
        self._task = JointPositionsTask(humanoid, _pull_scale(humanoid, settings))
        self._prior = MotionPriorTask(humanoid)
        limited = settings.human_limits == "on"
        self._limited = limited
        self._limits: list[mink.limits.Limit] = [HingeLimit(humanoid, MAX_STEP_RAD, limited=limited)]
        self._watch = None if self._combined else LimbWatch(humanoid, limited=limited)
        self._reach = np.array([settings.effectors[name].reach for name in CANONICAL])
        self._sigma = np.concatenate([_HIPS_SIGMA, _hinge_values(_SIGMA)]) / _resist_scale(settings)
        self._velocity = np.zeros(humanoid.model.nv)
        self._offset = np.zeros((len(CANONICAL), 3))
        self._last_joints = np.full((len(CANONICAL), 3), np.nan)
        self._started = False

    def solve(
        self, joints: NDArray[np.float64], sigma: NDArray[np.float64], dt: float
    ) -> NDArray[np.float64] | None:
        """Return the configuration, shape (nq,), that follows the joints.

        Args:
            joints: canonical joints [m], shape (21, 3), stage frame; NaN = unseen, as is one beyond `FAR_M`.
            sigma: their deviation [m], shape (21,); ignored where unseen.
            dt: time since the last frame [s].

        Returns:
            None until the joints have once shown how the performer stands.
        """
        joints = np.where((np.abs(joints) < FAR_M).all(axis=1, keepdims=True), joints, np.nan)
        seen = np.isfinite(joints[:, 0])
        if not self._started or self._lost(joints):
            found = self._start(joints, np.where(seen, 0.03, np.nan))
            self._started = self._started or found  # once begun, a pose that is lost goes on from where it is
            if not self._started:
                return None
        before = self._configuration.q.copy()
        guess = self._guess(joints, before, dt)
        self._prior.predicted = guess
        self._prior.stiffness = 1.0 / (self._sigma * max(dt, 1e-3)) ** 2
        self._prior.rest_stiffness = self._rest_stiffness(REST_WEIGHT)
        self._configuration.update(guess)
        weights = np.zeros(len(seen))
        weights[seen] = self._reach[seen] / np.hypot(sigma[seen], MODEL_SIGMA_M)
        targets = self._eased(joints, dt)
        self._task.set_targets(targets, weights)
        self._iterate(ITERATIONS)
        after = self._configuration.q
        if dt > 0:
            mujoco.mj_differentiatePos(self.humanoid.model, self._velocity, dt, before, after)
        return (
            after.copy() if self._watch is None else self._unstuck(self._watch, joints, targets, weights, dt)
        )

    def _unstuck(
        self,
        watch: LimbWatch,
        joints: NDArray[np.float64],
        targets: NDArray[np.float64],
        weights: NDArray[np.float64],
        dt: float,
    ) -> NDArray[np.float64]:
        """The configuration to show, with a stuck limb started anew."""
        q = self._configuration.q
        sites = self._configuration.data.site_xpos[self.humanoid.site_ids]
        found = watch.found(q, sites, targets, weights, lambda: self._shown(joints), dt)
        if found is not None:
            q, hinges = found
            self._configuration.update(q)
            self._velocity[FREE_DOFS + hinges] = 0.0
        return watch.led(q, dt).copy()

    def _eased(self, joints: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """The joints, but one that turns up elsewhere is brought there over `EASE_S` instead of in one frame."""
        if self._combined:
            return joints
        self._offset *= np.exp(-dt / EASE_S)
        reach = JUMP_M_S * max(dt, 1e-3)
        expected = self._configuration.data.site_xpos[self.humanoid.site_ids]
        away = np.linalg.norm(joints + self._offset - expected, axis=1) > reach  # False where unseen
        moved = ~(np.linalg.norm(joints - self._last_joints, axis=1) < reach)  # True where it was unseen
        self._offset[away & moved] = (expected - joints)[away & moved]
        self._last_joints = joints
        return joints + self._offset

    def _lost(self, joints: NDArray[np.float64]) -> bool:
        trunk = joints[_TRUNK] - self._configuration.data.site_xpos[self.humanoid.site_ids[_TRUNK]]
        distance = np.linalg.norm(trunk[np.isfinite(trunk[:, 0])], axis=1)
        return len(distance) > 2 and float(np.median(distance)) > LOST_M

    def _guess(
        self, joints: NDArray[np.float64], before: NDArray[np.float64], dt: float
    ) -> NDArray[np.float64]:
        """Where the iterations start, and what they are pulled to."""
        if self._combined:
            shown = self._shown(joints)
            if shown is not None:
                return shown
        guess = before.copy()
        mujoco.mj_integratePos(self.humanoid.model, guess, VELOCITY_SHARE * self._velocity, min(dt, CARRY_S))
        if self._limited:
            guess[7:] = np.clip(guess[7:], *self.humanoid.range_rad.T)
        return guess

    def _shown(self, joints: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The configuration that the joints themselves show, or None where they do not show the trunk."""
        rotations = swing_rotations(self.humanoid.skeleton, joints)
        if rotations is None or not np.isfinite(joints[INDEX["hips"]]).all():
            return None
        return configuration_of(self.humanoid, joints[INDEX["hips"]], rotations, limited=self._limited)

    def _start(self, joints: NDArray[np.float64], sigma: NDArray[np.float64]) -> bool:
        """Find a first pose from the joints alone; False where they do not show the trunk."""
        shown = self._shown(joints)
        if shown is None:
            return False
        seen = np.isfinite(joints[:, 0])
        weights = np.zeros(len(seen))
        weights[seen] = self._reach[seen] / sigma[seen]
        self._task.set_targets(joints, weights)
        self._prior.predicted = shown
        self._prior.stiffness = np.full(self.humanoid.model.nv, 1.0)
        self._prior.rest_stiffness = self._rest_stiffness(1.0)
        self._configuration.update(shown)
        self._iterate(FIRST_ITERATIONS)
        self._velocity[:] = 0.0
        self._offset[:] = 0.0
        if self._watch is not None:
            self._watch.forget()
        self._last_joints = joints
        return True

    def _rest_stiffness(self, weight: float) -> NDArray[np.float64]:
        return np.concatenate([np.zeros(FREE_DOFS), weight / self.humanoid.spread_rad**2])

    def _iterate(self, count: int) -> None:
        for _ in range(count):
            step = mink.solve_ik(
                self._configuration,
                [self._task, self._prior],
                1.0,
                "daqp",
                damping=DAMPING,
                limits=self._limits,
            )
            self._configuration.integrate_inplace(step, 1.0)


def _pull_scale(humanoid: Humanoid, settings: SolveSettings) -> NDArray[np.float64] | None:
    """Share of each joint's pull on each degree of freedom, shape (21, nv): `pull` beyond the joint's own limb,
    1 within it; None where every pull is whole."""
    pulls = np.array([settings.effectors[name].pull for name in CANONICAL])
    if (pulls == 1.0).all():
        return None
    trunk = np.ones(humanoid.model.nv, dtype=bool)
    at = FREE_DOFS
    for name in BODY_JOINTS[1:]:
        count = len(dofs_of(name))
        trunk[at : at + count] = name.startswith("Spine") or name.endswith("Shoulder")
        at += count
    limb = np.array(["_" in name and not name.endswith(("shoulder", "hip")) for name in CANONICAL])
    return np.where(limb[:, None] & trunk[None, :], pulls[:, None], 1.0)


def _resist_scale(settings: SolveSettings) -> NDArray[np.float64]:
    """How much stiffer than usual each degree of freedom is, shape (nv,): 1 to 11 by the joint's `resist`."""
    by_output = {OUTPUT_OF_CANONICAL[name]: effector.resist for name, effector in settings.effectors.items()}
    values = [by_output.get(name, 0.0) for name in BODY_JOINTS[1:] for _ in dofs_of(name)]
    return 1.0 + 10.0 * np.array([by_output["Hips"]] * FREE_DOFS + values)

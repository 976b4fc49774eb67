"""Robust fusion: a Kalman filter per joint. It weighs each camera's joint by its noise along and across the ray, and
rejects outliers.

A camera's joint that is too far from its prediction is rejected (`outlier`). A joint is accepted again when two
cameras agree on the new place, when it returns from a jump on a steady track (`courses`), or when it stays there for
`INSIST_S`, so that no limb is lost for good. Until then it moves with the body. A camera that exchanges left and
right (a performer from behind) is detected and corrected.

Source: the filter is the textbook one (Bar-Shalom, Li, Kirubarajan, "Estimation with applications to
tracking and navigation", 2001, sections 5.2 and 6.2: validation gate, discrete white noise acceleration).
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.joint_noise import covariances
from studio.engine.model.frames import FrameSet, FusedSkeleton
from studio.engine.model.joints import CANONICAL, JOINT_COUNT, MIRROR, PARENTS
from studio.engine.solve.fusion.courses import Courses
from studio.engine.solve.fusion.facing import Facing, exchanged_at_first

GATE = 20.0
"""Validation gate: squared Mahalanobis distance of an outlier (99.98 % of a chi-square of 3)."""

JUMP_GATE = 9.0
"""The gate of a joint that has just jumped."""

AGREE_M = 0.10
"""Two cameras within this distance agree on a new place."""

AGREE_S = 0.07
"""A place on which cameras agree for this long is accepted."""

INSIST_S = 0.4
"""A joint that one camera reports away from its prediction for this long is accepted."""

ELSEWHERE_SHARE = 0.5
ELSEWHERE_S = 0.1
"""If this share of all joints is rejected, the performer is elsewhere, and joints are accepted after this time."""

REJECTED_SIGMA_M = 0.1
"""Largest standard deviation of a rejected joint's prediction in the gate: a rejected joint must not
become acceptable only because time has passed.
"""

STEADY_S = 0.03
"""A joint without a jump for this long is on a steady track."""

ONSET_S = 0.05
"""A steady track that began within this time of a joint's first rejection began with the jump itself."""

FORGET_S = 0.5
"""A joint that no camera has seen for this long is unseen."""

INFLATION = 2.0
"""Noise is correlated from frame to frame, not white, so each frame carries less information than its covariance
says."""

VELOCITY_MEMORY_S = 0.25
"""Decay time of a joint's velocity."""

OWN_WAY_S = 0.08
"""Time for which an unseen joint keeps its own velocity; after it, it moves with the body."""

_ACCELERATION = {
    "shoulder": 15.0,
    "elbow": 30.0,
    "knee": 25.0,
    "wrist": 45.0,
    "hand": 55.0,
    "ankle": 30.0,
    "toe": 30.0,
}
ACCELERATION_M_S2: NDArray[np.float64] = np.array(
    [_ACCELERATION.get(n.split("_")[-1], 15.0) for n in CANONICAL]
)
"""Usual acceleration of each joint [m/s2]."""

_TRUNK = np.isin(
    CANONICAL, ["hips", "spine", "chest", "neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip"]
)
_PAIRED = np.flatnonzero(MIRROR != np.arange(JOINT_COUNT))


def _disagreement(joints: NDArray[np.float64], expected: NDArray[np.float64]) -> float:
    """Mean distance of the paired joints to their predictions, each clipped at 0.3 m."""
    distance = np.linalg.norm(joints[_PAIRED] - expected[_PAIRED], axis=1)
    distance = distance[~np.isnan(distance)]
    return float(np.minimum(distance, 0.3).mean()) if len(distance) else 0.0


class RobustFusion:
    """Fuses frame sets in time order, with a filter state per joint."""

    def __init__(self) -> None:
        self._time_ns: int | None = None
        self._state = np.zeros((JOINT_COUNT, 6))
        self._covariance = np.tile(np.eye(6), (JOINT_COUNT, 1, 1))
        self._known = np.zeros(JOINT_COUNT, dtype=bool)
        self._unseen_s = np.zeros(JOINT_COUNT)
        self._rejected_s = np.zeros(JOINT_COUNT)
        self._agreed_s = np.zeros(JOINT_COUNT)
        self._followed = np.ones(JOINT_COUNT, dtype=bool)
        self._doubtful = np.zeros(JOINT_COUNT, dtype=bool)
        self._facing = Facing()
        self._courses: Courses | None = None
        self._left_out = np.zeros((0, JOINT_COUNT), dtype=bool)

    def fuse(self, frames: FrameSet) -> FusedSkeleton:
        """Return the skeleton at the frame set's time."""
        dt = 0.0 if self._time_ns is None else (frames.stage_time_ns - self._time_ns) * 1e-9
        if not 0.0 <= dt < FORGET_S:
            self._known[:] = False
            dt = 0.0
        self._time_ns = frames.stage_time_ns
        self._predict(dt)
        positions, confidence = self._unswapped(frames)
        seen = ~np.isnan(positions[:, :, 0])
        noise = INFLATION * covariances(np.nan_to_num(positions), confidence, frames.camera_positions)
        steady = self._steady(positions, noise, seen, dt)
        agreed = _agreed(positions, seen)
        accepted = self._gate(positions, noise, seen, steady, agreed, dt)
        adopted = self._believe_again(positions, noise, seen, accepted, steady, agreed, dt)
        used = accepted | adopted
        self._left_out = np.where(seen, ~used | (self._left_out & ~steady), self._left_out)
        self._doubtful = np.where(used.any(axis=0), ~(used & steady).any(axis=0), self._doubtful)
        for camera in range(len(positions)):
            self._update(positions[camera], noise[camera], accepted[camera])
        if self._facing.backwards(np.where(self._known[:, None], self._state[:, :3], np.nan), dt):
            self._turn_round()
        return self._result(frames, confidence, seen, used, dt)

    def _predict(self, dt: float) -> None:
        if not self._followed.all():
            self._carry_along(dt)
        transition = np.eye(6)
        transition[:3, 3:] = dt * np.eye(3)
        transition[3:, 3:] *= np.exp(-dt / VELOCITY_MEMORY_S)
        self._state = self._state @ transition.T
        self._covariance = transition @ self._covariance @ transition.T
        variance = ACCELERATION_M_S2**2
        for row, column, factor in ((0, 0, dt**4 / 4), (0, 3, dt**3 / 2), (3, 0, dt**3 / 2), (3, 3, dt**2)):
            for k in range(3):
                self._covariance[:, row + k, column + k] += factor * variance

    def _carry_along(self, dt: float) -> None:
        """Move joints that the last frame did not show with the nearest inward joint that it showed."""
        with_joint = []
        for joint, parent in enumerate(PARENTS):
            with_joint.append(joint if self._followed[joint] or parent < 0 else with_joint[parent])
        velocity = self._state[with_joint, 3:]
        if not self._followed[0]:
            trunk = self._followed & _TRUNK
            of_trunk = self._state[trunk, 3:].mean(axis=0) if trunk.any() else np.zeros(3)
            velocity[np.array(with_joint) == 0] = of_trunk
        share = np.exp(-dt / OWN_WAY_S)
        own = self._state[:, 3:]
        self._state[:, 3:] = np.where(self._followed[:, None], own, velocity + share * (own - velocity))

    def _unswapped(self, frames: FrameSet) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Joints and confidence, with left and right exchanged where a camera confuses them."""
        positions, confidence = frames.positions, frames.confidence
        if not self._known[_PAIRED].any():
            exchanged = exchanged_at_first(positions, confidence)
        else:
            expected = np.where(self._known[:, None], self._state[:, :3], np.nan)
            as_is = np.array([_disagreement(joints, expected) for joints in positions])
            mirrored = np.array([_disagreement(joints[MIRROR], expected) for joints in positions])
            exchanged = (mirrored < 0.7 * as_is) & (as_is > 0.06)
        if exchanged.any():
            positions = np.where(exchanged[:, None, None], positions[:, MIRROR], positions)
            confidence = np.where(exchanged[:, None], confidence[:, MIRROR], confidence)
        return positions, confidence

    def _turn_round(self) -> None:
        """Exchange left and right in the whole state."""
        for name in ("_state", "_covariance", "_known", "_unseen_s", "_rejected_s", "_agreed_s", "_followed"):
            setattr(self, name, getattr(self, name)[MIRROR])
        self._doubtful = self._doubtful[MIRROR]
        self._courses = None  # restarted, because the cameras' joints have other names now

    def _steady(
        self, positions: NDArray[np.float64], noise: NDArray[np.float64], seen: NDArray[np.bool_], dt: float
    ) -> NDArray[np.bool_]:
        """Joints that are on a track without a jump, by camera, shape (camera_count, 21)."""
        if self._courses is None or len(self._courses.steady_s) != len(positions):
            self._courses = Courses(len(positions))
            self._left_out = np.zeros(seen.shape, dtype=bool)
        return self._courses.follow(positions, noise, seen, dt) > STEADY_S

    def _gate(
        self,
        positions: NDArray[np.float64],
        noise: NDArray[np.float64],
        seen: NDArray[np.bool_],
        steady: NDArray[np.bool_],
        agreed: NDArray[np.bool_],
        dt: float,
    ) -> NDArray[np.bool_]:
        """Joints within the validation gate, shape (camera_count, 21).

        A joint that just jumped has a narrower gate than one on a steady track. It is rejected if other cameras see
        the joint and it was rejected before, because spikes come in bursts and some come near. A joint
        that is rejected in all cameras must not become acceptable only because time passes, unless it jumped again
        and so came back.
        """
        assert self._courses is not None
        there_since_s = self._rejected_s - self._courses.steady_s
        came_back = steady & ((there_since_s > ONSET_S) | (there_since_s < -2.5 * dt))
        burst = self._left_out & (seen.sum(axis=0) > 1)
        trusted = steady & (came_back | (self._rejected_s == 0.0)) | agreed
        limit = np.where(trusted, GATE, np.where(burst & ~steady, 0.0, JUMP_GATE))
        innovation = np.where(seen[:, :, None], positions, 0.0) - self._state[None, :, :3]
        place = self._covariance[:, :3, :3]
        share = np.minimum(3.0 * REJECTED_SIGMA_M**2 / np.trace(place, axis1=1, axis2=2), 1.0)
        share = np.where(came_back | (self._rejected_s == 0.0), 1.0, share)
        total = noise + share[:, :, None, None] * place
        distance = np.einsum("cji,cji->cj", innovation, np.linalg.solve(total, innovation[..., None])[..., 0])
        return seen & self._known[None, :] & (distance < limit)

    def _believe_again(
        self,
        positions: NDArray[np.float64],
        noise: NDArray[np.float64],
        seen: NDArray[np.bool_],
        accepted: NDArray[np.bool_],
        steady: NDArray[np.bool_],
        agreed: NDArray[np.bool_],
        dt: float,
    ) -> NDArray[np.bool_]:
        """Reset joints that are new, that cameras agree on elsewhere, that were rejected for long enough, or that are
        steady where the last accepted one was not. Return which camera each was reset from.
        """
        nobody = seen.any(axis=0) & ~accepted.any(axis=0)
        self._rejected_s = np.where(nobody, self._rejected_s + dt, 0.0)
        agree = nobody & agreed
        self._agreed_s = np.where(agree, self._agreed_s + dt, 0.0)
        elsewhere = nobody.sum() > ELSEWHERE_SHARE * max(1, int(seen.any(axis=0).sum()))
        insist_s = ELSEWHERE_S if elsewhere else INSIST_S
        settled = nobody & self._doubtful & (seen & steady).any(axis=0)
        insists = (self._rejected_s > insist_s) | (self._agreed_s > AGREE_S)
        anew = seen.any(axis=0) & (~self._known | insists | settled)
        adopted = np.zeros_like(accepted)
        for joint in np.flatnonzero(anew):
            cameras = np.flatnonzero((seen & steady if settled[joint] else seen)[:, joint])
            best = self._most_central(positions[cameras, joint], noise[cameras, joint])
            self._state[joint] = 0.0
            self._state[joint, :3] = positions[cameras[best], joint]
            self._covariance[joint] = np.diag([0.05**2] * 3 + [2.0**2] * 3)
            self._known[joint], self._rejected_s[joint], self._agreed_s[joint] = True, 0.0, 0.0
            adopted[cameras[best], joint] = True
        return adopted

    @staticmethod
    def _most_central(points: NDArray[np.float64], noise: NDArray[np.float64]) -> int:
        """Index of the point with the smallest distance to the others; of two, the less noisy one."""
        distance = np.minimum(np.linalg.norm(points[:, None] - points[None], axis=2), 0.3).sum(axis=1)
        return int(np.argmin(distance + np.sqrt(np.trace(noise, axis1=1, axis2=2))))

    def _update(
        self, positions: NDArray[np.float64], noise: NDArray[np.float64], accepted: NDArray[np.bool_]
    ) -> None:
        j = np.flatnonzero(accepted)
        if not len(j):
            return
        covariance = self._covariance[j]
        gain = np.linalg.solve(covariance[:, :3, :3] + noise[j], covariance[:, :3, :]).transpose(0, 2, 1)
        self._state[j] += np.einsum("jab,jb->ja", gain, positions[j] - self._state[j, :3])
        covariance = covariance - gain @ covariance[:, :3, :]
        self._covariance[j] = 0.5 * (covariance + covariance.transpose(0, 2, 1))

    def _result(
        self,
        frames: FrameSet,
        confidence: NDArray[np.float64],
        seen: NDArray[np.bool_],
        accepted: NDArray[np.bool_],
        dt: float,
    ) -> FusedSkeleton:
        used_any = np.logical_or.reduce(accepted, axis=0)
        self._followed = used_any
        self._unseen_s = np.where(used_any, 0.0, self._unseen_s + dt)
        self._known &= self._unseen_s < FORGET_S
        positions = np.where(self._known[:, None], self._state[:, :3], np.nan)
        sigma = np.sqrt(np.trace(self._covariance[:, :3, :3], axis1=1, axis2=2) / 3.0)
        best = np.where(accepted, confidence, 0.0).max(axis=0)
        memory = np.exp(-self._unseen_s / 0.2) * 0.5
        fused_confidence = np.where(self._known, np.where(used_any, best, memory), 0.0)
        reasons = {
            (int(c), int(k)): ("disagrees" if used_any[k] else "outlier") if seen[c, k] else "unseen"
            for c, k in zip(*np.nonzero(~accepted), strict=True)
        }
        return FusedSkeleton(
            positions, fused_confidence, np.where(self._known, sigma, np.nan), accepted, reasons
        )


def _agreed(positions: NDArray[np.float64], seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Joints that two or more cameras see, all within `AGREE_M` along each axis, shape (21,)."""
    if len(positions) < 2:
        return np.zeros(JOINT_COUNT, dtype=bool)
    unseen = ~seen[:, :, None]
    high = np.where(unseen, -np.inf, positions).max(axis=0)
    low = np.where(unseen, np.inf, positions).min(axis=0)
    return (seen.sum(axis=0) >= 2) & (high - low < AGREE_M).all(axis=1)

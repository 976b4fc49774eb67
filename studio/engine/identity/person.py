"""A person who is followed by the joints of all cameras: predictions of their joints, and their bones' lengths.

Every joint has a Kalman filter of its own whose velocity fades (an Ornstein-Uhlenbeck process), so that the place of
a hidden person grows uncertain slowly: by a metre in two seconds.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.identity.person_kernels import (
    BONES_KEPT,
    READING_M,
    SPEED_M_S,
    deviations,
    expected_fit,
    gone_on,
    measure_bones,
    predicted,
)
from studio.engine.model.joints import JOINT_COUNT, MIRROR, PARENTS

_BONES_KNOWN = 300.0
"""Number of frames that bones known from before count for."""

_OWN_PARENTS = np.maximum(PARENTS, 0)

_Expected = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


class FollowedPerson:
    """One person's joints in the stage frame, by all cameras together."""

    def __init__(self, stage_s: float, joints: NDArray[np.float64]) -> None:
        """Begin with a body's joints [m], shape (21, 3); NaN = unseen."""
        seen = np.isfinite(joints[:, 0])
        self.last_s = self.first_s = stage_s
        self.frames = 1
        self._time_s = stage_s
        self._place = np.where(seen[:, None], joints, np.nan)
        self._speed = np.zeros((JOINT_COUNT, 3))
        self._cov = np.zeros((JOINT_COUNT, 3))  # variances of place and speed, and their covariance
        self._cov[:, 0], self._cov[:, 1] = READING_M**2, SPEED_M_S**2
        self._bones, self._bone_frames = np.zeros(JOINT_COUNT), np.zeros(JOINT_COUNT)
        self._ahead: tuple[float, _Expected] | None = None  # the prediction requested last, with its time
        self._measure(joints)

    @classmethod
    def known(
        cls,
        bones_m: NDArray[np.float64],
        joints: NDArray[np.float64] | None = None,
        stage_s: float = -np.inf,
    ) -> "FollowedPerson":
        """Return a person whose bones are known from before; without `joints` they are away.

        Args:
            bones_m: as `bones_m` returns them.
            joints: their last joints [m], shape (21, 3); NaN = unknown.
            stage_s: time of these joints [s].
        """
        person = cls(stage_s, np.full((JOINT_COUNT, 3), np.nan) if joints is None else joints)
        seen = np.isfinite(bones_m)
        person._bones, person._bone_frames = np.where(seen, bones_m, 0.0) * _BONES_KNOWN, seen * _BONES_KNOWN
        return person

    def remember(self, before: "FollowedPerson") -> None:
        """Take over the bones that the same person had when they were followed before."""
        frames = self._bone_frames + before._bone_frames
        kept = np.minimum(1.0, BONES_KEPT / np.maximum(frames, 1.0))
        self._bones = (self._bones + before._bones) * kept
        self._bone_frames = frames * kept

    def middle(self) -> NDArray[np.float64]:
        """Return the middle of the known joints [m], shape (3,)."""
        known = self._place[np.isfinite(self._place[:, 0])]
        return known.mean(axis=0)

    def joints_m(self) -> NDArray[np.float64]:
        """Return the last places of the joints [m], shape (21, 3); NaN = never seen."""
        return self._place.copy()

    def bones_m(self) -> NDArray[np.float64]:
        """Return the mean length of each joint's bone, both sides as one [m], shape (21,); NaN = unseen."""
        with np.errstate(invalid="ignore"):
            return np.where(self._bone_frames > 0, self._bones / np.maximum(self._bone_frames, 1), np.nan)

    def deviation(self, stage_s: float, bodies: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the deviation of bodies from this person, shape (body_count,): the mean square over its variance.

        A body whose left and right a camera has exchanged fits as well. Infinite where too few joints are known.

        Args:
            stage_s: the bodies' time [s].
            bodies: joints [m], shape (body_count, 21, 3); NaN = unseen.
        """
        bodies, dt = np.ascontiguousarray(bodies), stage_s - self._time_s
        if dt > 0.0 and (self._ahead is None or self._ahead[0] != stage_s):
            *expected, fits = expected_fit(self._place, self._speed, self._cov, dt, bodies, MIRROR)
            self._ahead = stage_s, tuple(expected)
            return fits
        place, _, cov = self._expected(stage_s)
        return deviations(place, cov, bodies, MIRROR)

    def add(self, stage_s: float, joints: NDArray[np.float64]) -> None:
        """Continue with a body that is this person: joints [m], shape (21, 3); NaN = unseen."""
        place, speed, cov = self._expected(stage_s)
        joints = np.ascontiguousarray(joints)
        self._place, self._speed, self._cov, self._bones, self._bone_frames = gone_on(
            place, speed, cov, joints, _OWN_PARENTS, MIRROR, self._bones, self._bone_frames
        )
        self._ahead = None
        self._time_s = self.last_s = max(stage_s, self._time_s)
        self.frames += 1

    def _expected(self, stage_s: float) -> _Expected:
        """Return places, speeds and their covariances at a time; a time before the last counts as the last."""
        if self._ahead is None or self._ahead[0] != stage_s:
            self._ahead = stage_s, self._predicted(stage_s)
        return self._ahead[1]

    def _predicted(self, stage_s: float) -> _Expected:
        dt = max(stage_s - self._time_s, 0.0)
        if dt == 0.0:
            return self._place, self._speed, self._cov
        return predicted(self._place, self._speed, self._cov, dt)

    def _measure(self, joints: NDArray[np.float64]) -> None:
        self._bones, self._bone_frames = measure_bones(
            joints, _OWN_PARENTS, MIRROR, self._bones, self._bone_frames
        )

"""A person who is followed by the joints of all cameras: where they are expected, and how long their bones are.

Every joint has a Kalman filter of its own whose velocity fades (an Ornstein-Uhlenbeck process), so that the place of
a hidden person grows uncertain slowly: by a metre in two seconds.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_COUNT, MIRROR, PARENTS

_FADES_S = 0.3
_SPEED_M_S = 1.5
_READING_M = 0.10
"""Standard deviation of a camera's joint against that of the others; most of it is alike from frame to frame."""

_WORST = 16.0
"""A joint's squared deviation counts at most this much, so that one wrong arm does not decide."""

_LEAST_JOINTS = 5
_MIRRORED_M = 0.03
_BONES_KEPT = 900
"""Frames over which bones are averaged."""

_BONES_KNOWN = 300.0
"""So many frames do bones count that are known from before."""


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
        self._cov[:, 0], self._cov[:, 1] = _READING_M**2, _SPEED_M_S**2
        self._bones, self._bone_frames = np.zeros(JOINT_COUNT), np.zeros(JOINT_COUNT)
        self._ahead: tuple[float, _Expected] | None = None  # what is expected at the time asked for last
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
            joints: where they were last [m], shape (21, 3); NaN = unknown.
            stage_s: when that was [s].
        """
        person = cls(stage_s, np.full((JOINT_COUNT, 3), np.nan) if joints is None else joints)
        seen = np.isfinite(bones_m)
        person._bones, person._bone_frames = np.where(seen, bones_m, 0.0) * _BONES_KNOWN, seen * _BONES_KNOWN
        return person

    def middle(self) -> NDArray[np.float64]:
        """Return the middle of the known joints [m], shape (3,)."""
        known = self._place[np.isfinite(self._place[:, 0])]
        return known.mean(axis=0)

    def joints_m(self) -> NDArray[np.float64]:
        """Return where the joints were last [m], shape (21, 3); NaN = never seen."""
        return self._place.copy()

    def bones_m(self) -> NDArray[np.float64]:
        """Return the mean length of each joint's bone, both sides as one [m], shape (21,); NaN = unseen."""
        with np.errstate(invalid="ignore"):
            return np.where(self._bone_frames > 0, self._bones / np.maximum(self._bone_frames, 1), np.nan)

    def deviation(self, stage_s: float, bodies: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how badly bodies fit this person, shape (body_count,): the mean squared deviation over its variance.

        A body whose left and right a camera has exchanged fits as well. Infinite where too few joints are known.

        Args:
            stage_s: the bodies' time [s].
            bodies: joints [m], shape (body_count, 21, 3); NaN = unseen.
        """
        place, _, cov = self._expected(stage_s)
        variance = cov[:, 0] + _READING_M**2
        both = np.stack([bodies, bodies[:, MIRROR]])
        squares = ((both - place) ** 2).sum(axis=3) / (3.0 * variance)
        known = np.isfinite(squares)
        count = known.sum(axis=2)
        total = np.where(known, np.minimum(squares, _WORST), 0.0).sum(axis=2)
        mean = np.where(count >= _LEAST_JOINTS, total / np.maximum(count, 1), np.inf)
        return mean.min(axis=0)

    def add(self, stage_s: float, joints: NDArray[np.float64]) -> None:
        """Go on with a body that is this person: joints [m], shape (21, 3); NaN = unseen."""
        place, speed, cov = self._expected(stage_s)
        if self._is_mirrored(joints, place):
            joints = joints[MIRROR]
        seen = np.isfinite(joints[:, 0])
        new = seen & ~np.isfinite(place[:, 0])
        old = seen & ~new
        rest = np.where(old[:, None], joints - place, 0.0)
        total = cov[:, 0] + _READING_M**2
        # A joint that is far from where it was expected pulls no more than one at four deviations.
        rest *= np.minimum(1.0, 4.0 * np.sqrt(total) / np.maximum(np.linalg.norm(rest, axis=1), 1e-9))[
            :, None
        ]
        gain, gain_speed = np.where(old, cov[:, 0] / total, 0.0), np.where(old, cov[:, 2] / total, 0.0)
        place = place + gain[:, None] * rest
        speed = speed + gain_speed[:, None] * rest
        cov = np.stack(
            [(1.0 - gain) * cov[:, 0], cov[:, 1] - gain_speed * cov[:, 2], (1.0 - gain) * cov[:, 2]], axis=1
        )
        place[new], speed[new] = joints[new], 0.0
        cov[new] = _READING_M**2, _SPEED_M_S**2, 0.0
        self._place, self._speed, self._cov, self._ahead = place, speed, cov, None
        self._time_s = self.last_s = max(stage_s, self._time_s)
        self.frames += 1
        self._measure(joints)

    def _expected(self, stage_s: float) -> _Expected:
        """Return places, speeds and their covariances at a time; a time before the last counts as the last."""
        if self._ahead is None or self._ahead[0] != stage_s:
            self._ahead = stage_s, self._predicted(stage_s)
        return self._ahead[1]

    def _predicted(self, stage_s: float) -> _Expected:
        dt = max(stage_s - self._time_s, 0.0)
        if dt == 0.0:
            return self._place, self._speed, self._cov
        fade = np.exp(-dt / _FADES_S)
        reach = _FADES_S * (1.0 - fade)
        speed_var = fade**2 * self._cov[:, 1] + (1.0 - fade**2) * _SPEED_M_S**2
        cross = (
            fade * (self._cov[:, 2] + reach * self._cov[:, 1]) + _SPEED_M_S**2 * _FADES_S * (1 - fade) ** 2
        )
        walked = _SPEED_M_S**2 * (
            2 * _FADES_S * dt - 4 * _FADES_S**2 * (1 - fade) + _FADES_S**2 * (1 - fade**2)
        )
        place_var = self._cov[:, 0] + 2 * reach * self._cov[:, 2] + reach**2 * self._cov[:, 1] + walked
        return (
            self._place + reach * self._speed,
            fade * self._speed,
            np.stack([place_var, speed_var, cross], 1),
        )

    def _is_mirrored(self, joints: NDArray[np.float64], place: NDArray[np.float64]) -> bool:
        as_told, exchanged = (np.linalg.norm(one - place, axis=1) for one in (joints, joints[MIRROR]))
        both = np.isfinite(as_told) & np.isfinite(exchanged)
        return bool(both.any() and exchanged[both].mean() < as_told[both].mean() - _MIRRORED_M)

    def _measure(self, joints: NDArray[np.float64]) -> None:
        lengths = np.linalg.norm(joints - joints[np.maximum(PARENTS, 0)], axis=1)
        lengths = np.stack([lengths, lengths[MIRROR]])
        seen = np.isfinite(lengths)
        count = seen.sum(axis=0)
        mean = np.where(seen, lengths, 0.0).sum(axis=0) / np.maximum(count, 1)
        keep = np.where(self._bone_frames >= _BONES_KEPT, 1.0 - 1.0 / _BONES_KEPT, 1.0)
        self._bones = keep * self._bones + np.where(count > 0, mean, 0.0)
        self._bone_frames = keep * self._bone_frames + (count > 0)

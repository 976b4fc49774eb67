"""Places of rigid bodies on joints, and of their system on the stage, measured against a solve of the same take.

A body on a joint keeps its offset to it, in its own axes. A robust least-squares fit of all bodies to their joints
gives the place of their system (turned about the vertical alone, because both know the vertical), one delay, and an
offset for each body. Turns of the body separate its offset from the place of the system. Without turns only their sum
is known, so the offset is held near 0 (`OFFSET_SIGMA_M`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.quaternions import rotate
from studio.engine.rigid_bodies.known import BodyPlace, Tie
from studio.engine.rigid_bodies.tracks import BodyTrack

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

OFFSET_SIGMA_M = 0.10
LAGS_S = (-0.15, 0.15)
_SCALE_M = 0.03
_MOST_SAMPLES = 400
_LEAST = 20
_COARSE = 5


@dataclass(frozen=True)
class Measured:
    """Place of a system of rigid bodies, the time added to its readings [s], and the ties of bodies to joints."""

    place: BodyPlace
    later_s: float
    ties: dict[str, Tie]


def measure_ties(
    time_s: NDArray[np.float64],
    joints_m: Mapping[str, NDArray[np.float64]],
    tracks: Mapping[str, BodyTrack],
    *,
    place: BodyPlace | None = None,
) -> Measured:
    """Return the place of a system of rigid bodies, its delay, and the ties of bodies to their joints.

    Args:
        time_s: stage time of the solve's frames [s], shape (n,).
        joints_m: by body, its joint in the solve, stage frame [m], shape (n, 3).
        tracks: by body, its motion in its own system.
        place: of that system; None = it is measured too.

    Raises:
        FormatError: no body is known for long enough with its joint.
    """
    names = [name for name in joints_m if name in tracks]
    chosen = np.unique(np.linspace(0, len(time_s) - 1, _MOST_SAMPLES).round().astype(int))
    seen = {name: np.isfinite(tracks[name].at(time_s[chosen])[0]).all(axis=1) for name in names}
    names = [name for name in names if seen[name].sum() >= _LEAST]
    if not names:
        raise FormatError(
            "rigid.not_seen",
            "no rigid body on a joint was seen for long enough in this take; allowed: at least {n} of its frames",
            n=_LEAST,
        )
    times = [time_s[chosen][seen[name]] for name in names]
    joints = [joints_m[name][chosen][seen[name]] for name in names]
    problem = _Problem(times, joints, [tracks[name] for name in names], place)
    few = problem.with_every(_COARSE)
    first = min((few.solved(few.first(yaw)) for yaw in few.first_yaws()), key=lambda one: one.cost)
    found = problem.solved(first.x)
    measured, lag_s, offsets = problem.read(found.x)
    ties = {}
    for k, name in enumerate(names):
        away = np.linalg.norm(problem.apart(k, measured, lag_s, offsets[k]), axis=1)
        x, y, z = offsets[k].round(5).tolist()
        ties[name] = Tie((x, y, z), round(float(np.median(away)) * 1e3, 2))
    return Measured(measured, round(lag_s, 4), ties)


class _Problem:
    """The least-squares problem over yaw, place, delay and offsets."""

    def __init__(
        self,
        times_s: list[NDArray[np.float64]],
        joints_m: list[NDArray[np.float64]],
        tracks: list[BodyTrack],
        place: BodyPlace | None,
    ) -> None:
        self._times_s, self._joints_m, self._tracks, self._place = times_s, joints_m, tracks, place

    def first_yaws(self) -> list[float]:
        """Start values of the yaw [rad]."""
        return [0.0] if self._place is not None else (np.arange(4) * np.pi / 2).tolist()

    def read(self, x: NDArray[np.float64]) -> tuple[BodyPlace, float, NDArray[np.float64]]:
        """Return the place, the delay [s] and the offsets [m], shape (body_count, 3), of the unknowns."""
        offsets = x[5:].reshape(-1, 3)
        if self._place is not None:
            return self._place, float(x[4]), offsets
        yaw_deg = (np.degrees(x[3]) + 180.0) % 360.0 - 180.0
        place = BodyPlace(*(round(float(one), 5) for one in x[:3]), yaw_deg=round(float(yaw_deg), 4))
        return place, float(x[4]), offsets

    def with_every(self, step: int) -> "_Problem":
        """Return the problem with fewer samples."""
        times, joints = ([one[::step] for one in mine] for mine in (self._times_s, self._joints_m))
        return _Problem(times, joints, self._tracks, self._place)

    def first(self, yaw: float) -> NDArray[np.float64]:
        """Return start values of the unknowns with this yaw [rad]."""
        first = np.concatenate([np.zeros(3), [yaw, 0.0], np.zeros(3 * len(self._tracks))])
        if self._place is None:
            start = BodyPlace(yaw_deg=float(np.degrees(yaw)))
            first[:3] = np.median(
                np.concatenate([self.apart(k, start, 0.0, np.zeros(3)) for k in range(len(self._tracks))]),
                axis=0,
            )
        return first

    def solved(self, first: NDArray[np.float64]) -> "OptimizeResult":
        """Return the solution from these start values."""
        from scipy.optimize import least_squares  # slow to load, so not at the start of the server

        low, high = np.full(len(first), -np.inf), np.full(len(first), np.inf)
        low[4], high[4] = LAGS_S
        return least_squares(
            self._residuals, first, loss="soft_l1", f_scale=1.0, bounds=(low, high), max_nfev=60
        )

    def apart(
        self, k: int, place: BodyPlace, lag_s: float, offset_m: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the joint minus its place by a body, shape (n, 3) [m]."""
        positions, rotations = self._tracks[k].filled_at(self._times_s[k] - lag_s)
        positions, rotations = place.moved(positions, rotations)
        return self._joints_m[k] - positions - rotate(rotations, np.broadcast_to(offset_m, positions.shape))

    def _residuals(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._place is None:
            place = BodyPlace(*map(float, x[:3]), yaw_deg=float(np.degrees(x[3])))
        else:
            place = self._place
        offsets = x[5:].reshape(-1, 3)
        rows = [self.apart(k, place, float(x[4]), offsets[k]).ravel() / _SCALE_M for k in range(len(offsets))]
        return np.concatenate([*rows, offsets.ravel() / OFFSET_SIGMA_M])


def joint_places_m(track: BodyTrack, tie: Tie, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the places of a joint by its body on the stage at these times [m], shape (n, 3); NaN = unknown."""
    positions, rotations = track.at(time_s)
    return positions + rotate(rotations, np.broadcast_to(np.array(tie.offset_m), positions.shape))

"""The banded problem of finishing: all frames' configurations at once.

Minimises, over the tangent steps of all frames, what the cameras disagree with (Cauchy costs, reweighted), how
far each degree of freedom accelerates (its own deviation), how far hinges stray from rest where nothing shows
them, and how far standing feet slide. Gauss-Newton; frames couple with the next two only, so the normal matrix
is banded and the cost grows linearly with the take.

Source: batch estimation with a white-noise-on-acceleration prior (Barfoot, "State estimation for robotics",
2017, section 3.1 and 4.3); Cauchy reweighting (Zhang, "Parameter estimation techniques", 1997, section 9).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from studio.engine.finish.contacts import Contacts
from studio.engine.finish.measurements import Measurements
from studio.engine.finish.trajectory import Trajectory
from studio.engine.human.model import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.human.ranges import dofs_of

CAUCHY = 4.0
"""Deviations beyond this many sigma count less and less."""

INFLATION = 4.0
"""A camera's noise is alike from frame to frame: each frame tells this much less than its covariance says."""

DAMPING = 100.0
"""Keeps steps where the linear model holds [1/rad2]; a joint's own rows weigh a hundred times more."""

MAX_STEP = 0.3
HELD = 1e10

TAIL = 2.0
"""Accelerations beyond this many deviations are held back less and less: feet land, fists stop."""

REST_WEIGHT = 0.1
SLIDE_SIGMA_M = 0.0001
"""How far a standing foot may slide in a frame [m]."""

HEIGHT_SIGMA_M = 0.01
"""How far a standing foot's height may be from the height it stands at [m]."""

# Deviation of accelerations [m/s2, rad/s2] by output joint; the free hips first.
_HIPS = (20.0, 20.0, 28.0, 50.0, 50.0, 50.0)
_ACCELERATION = {
    "Spine": 32.0, "Spine1": 32.0, "Spine2": 32.0, "Neck": 48.0, "Head": 48.0, "Shoulder": 48.0, "Arm": 120.0,
    "ForeArm": 140.0, "Hand": 120.0, "UpLeg": 100.0, "Leg": 140.0, "Foot": 120.0, "ToeBase": 100.0,
}  # fmt: skip


def acceleration_sigma() -> NDArray[np.float64]:
    """Deviation of each degree of freedom's acceleration, shape (nv,)."""
    sides = [
        name.removeprefix("Left").removeprefix("Right") for name in BODY_JOINTS[1:] for _ in dofs_of(name)
    ]
    return np.array([*_HIPS, *(_ACCELERATION[name] for name in sides)])


@dataclass(frozen=True)
class _Normal:
    """The normal equations: blocks of the matrix (lower triangle) and the right-hand side."""

    diagonal: NDArray[np.float64]  # (frame_count, nv, nv)
    next: NDArray[np.float64]  # (frame_count - 1, nv, nv): rows t + 1, columns t
    second: NDArray[np.float64]  # (frame_count - 2, nv): diagonal of rows t + 2, columns t
    right: NDArray[np.float64]  # (frame_count, nv)

    def solve(self) -> NDArray[np.float64]:
        """The steps, shape (frame_count, nv)."""
        frames, nv = self.right.shape
        band = np.zeros((3 * nv, frames * nv))
        columns = band.reshape(3 * nv, frames, nv)
        for j in range(nv):
            columns[: nv - j, :, j] = self.diagonal[:, j:, j].T
            columns[nv - j : 2 * nv - j, :-1, j] = self.next[:, :, j].T
            columns[2 * nv, :-2, j] = self.second[:, j]
        band[0] += DAMPING
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
        return cho_solve_banded((factor, True), self.right.ravel(), check_finite=False).reshape(frames, nv)


class Smoother:
    """Refines a trajectory by the measurements of its frames, `dt` apart [s]."""

    def __init__(self, humanoid: Humanoid, dt: float, *, limited: bool = True) -> None:
        self._humanoid = humanoid
        self._stiffness = 1.0 / (acceleration_sigma() * dt**2) ** 2
        rest = REST_WEIGHT / humanoid.spread_rad**2 * dt * 60.0
        self._rest_stiffness = np.concatenate([np.zeros(FREE_DOFS), rest])
        self._rest = np.concatenate([np.zeros(FREE_DOFS), humanoid.rest_q])
        self._low, self._high = humanoid.range_rad.T if limited else (-np.inf, np.inf)
        self._dt = dt

    def refine(
        self, trajectory: Trajectory, measurements: Measurements, contacts: Contacts | None, iterations: int
    ) -> None:
        """Move the trajectory to the minimum, in place."""
        for _ in range(iterations):
            normal = self._normal(trajectory, measurements, contacts)
            self._hold_at_limits(trajectory, normal)
            trajectory.step(np.clip(normal.solve(), -MAX_STEP, MAX_STEP), self._low, self._high)

    def _hold_at_limits(self, trajectory: Trajectory, normal: _Normal) -> None:
        """Hinges at a limit that are pushed beyond it stay: the others must not count on them."""
        q, push = trajectory.q[:, 7:], normal.right[:, FREE_DOFS:]
        held = ((q <= self._low) & (push < 0)) | ((q >= self._high) & (push > 0))
        frames, hinges = np.nonzero(held)
        normal.diagonal[frames, FREE_DOFS + hinges, FREE_DOFS + hinges] += HELD
        push[held] = 0.0

    def _normal(
        self, trajectory: Trajectory, measurements: Measurements, contacts: Contacts | None
    ) -> _Normal:
        sites, jacobians = trajectory.linearised()
        frames, nv = len(sites), jacobians.shape[2]
        weight, pull = self._camera_rows(sites, measurements)
        j = jacobians.reshape(frames, -1, 3, nv)
        weighted = np.matmul(weight, j).reshape(frames, -1, nv)
        diagonal = np.matmul(jacobians.transpose(0, 2, 1), weighted)
        right = np.matmul(pull.reshape(frames, 1, -1), jacobians)[:, 0]
        following = np.zeros((frames - 1, nv, nv))
        second = np.zeros((frames - 2, nv))
        self._rest_rows(trajectory, diagonal, right)
        self._acceleration_rows(trajectory, diagonal, following, second, right)
        if contacts is not None:
            _contact_rows(contacts, sites, jacobians, diagonal, following, right)
        return _Normal(diagonal, following, second, right)

    @staticmethod
    def _camera_rows(
        sites: NDArray[np.float64], measurements: Measurements
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Per frame and joint: the cameras' information, reweighted, and information times difference."""
        difference = measurements.positions - sites[:, None]
        information = measurements.information / INFLATION
        whole = np.einsum("tcjab,tcjb->tcja", information, difference)
        squared = INFLATION * np.einsum("tcja,tcja->tcj", difference, whole)
        cauchy = 1.0 / (1.0 + squared / CAUCHY**2)
        weight = np.einsum("tcj,tcjab->tjab", cauchy, information)
        return weight, np.einsum("tcj,tcja->tja", cauchy, whole)

    def _rest_rows(
        self, trajectory: Trajectory, diagonal: NDArray[np.float64], right: NDArray[np.float64]
    ) -> None:
        nv = len(self._rest)
        diagonal[:, np.arange(nv), np.arange(nv)] += self._rest_stiffness
        away = trajectory.q[:, 7:] - self._rest[FREE_DOFS:]
        right[:, FREE_DOFS:] -= self._rest_stiffness[FREE_DOFS:] * away

    def _acceleration_rows(
        self,
        trajectory: Trajectory,
        diagonal: NDArray[np.float64],
        following: NDArray[np.float64],
        second: NDArray[np.float64],
        right: NDArray[np.float64],
    ) -> None:
        velocity = trajectory.velocities()
        acceleration = velocity[1:] - velocity[:-1]
        stiffness = self._stiffness / (1.0 + self._stiffness * acceleration**2 / TAIL**2)
        pull = stiffness * acceleration
        right[:-2] -= pull
        right[1:-1] += 2.0 * pull
        right[2:] -= pull
        k = np.arange(stiffness.shape[1])
        for rows, factor in ((slice(None, -2), 1.0), (slice(1, -1), 4.0), (slice(2, None), 1.0)):
            diagonal[rows, k, k] += factor * stiffness
        following[:-1, k, k] -= 2.0 * stiffness
        following[1:, k, k] -= 2.0 * stiffness
        second += stiffness


def _contact_rows(
    contacts: Contacts,
    sites: NDArray[np.float64],
    jacobians: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    following: NDArray[np.float64],
    right: NDArray[np.float64],
) -> None:
    """Standing joints do not move from one frame to the next, and stand at their height."""
    weight = 1.0 / SLIDE_SIGMA_M**2
    for column, joint in enumerate(contacts.joints):
        rows = slice(3 * joint, 3 * joint + 3)
        both = np.flatnonzero(contacts.standing[:-1, column] & contacts.standing[1:, column])
        a, b = jacobians[both, rows], jacobians[both + 1, rows]
        slide = sites[both + 1, joint] - sites[both, joint]
        diagonal[both] += weight * np.matmul(a.transpose(0, 2, 1), a)
        diagonal[both + 1] += weight * np.matmul(b.transpose(0, 2, 1), b)
        following[both] -= weight * np.matmul(b.transpose(0, 2, 1), a)
        right[both] += weight * np.einsum("ta,tav->tv", slide, a)
        right[both + 1] -= weight * np.einsum("ta,tav->tv", slide, b)
        stands = np.flatnonzero(contacts.standing[:, column])
        z = jacobians[stands, 3 * joint + 2]
        height = (contacts.height_m[column] - sites[stands, joint, 2]) / HEIGHT_SIGMA_M**2
        diagonal[stands] += z[:, :, None] * z[:, None, :] / HEIGHT_SIGMA_M**2
        right[stands] += height[:, None] * z

"""One correction of a state by joints: the gain form of the filter, with hinges held at the ends of their ranges."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from studio.engine.model.human.humanoid import FREE_DOFS
from studio.engine.solve.kalman.kernels import measured_blocks

Array = NDArray[np.float64]

_LEAST_INFORMATION = 1e-3
"""A joint with less information than this [1/m2] is not a row."""

_HELD_VARIANCE = 1e-8
_TOLERANCE = 1e-3


class Correction:
    """Finds the most likely configuration and velocity given joints at a slightly later configuration.

    Attributes:
        moved: movement of the joints by the last solve [m], shape (21, 3).
        beyond: whether it moves hinges beyond their ranges.
    """

    def __init__(self, with_later: Array, added: Array, late_s: float, jacobian: Array) -> None:
        """Linearise.

        Args:
            with_later: covariance of the state with the later configuration, shape (2 nv, nv).
            added: process noise of the interval, added to that configuration's variances, shape (nv,).
            late_s: length of the interval [s].
            jacobian: of the joints there, shape (63, nv).
        """
        nv = len(added)
        self._with_later, self._added, self._late_s, self._jacobian = with_later, added, late_s, jacobian
        self._state = with_later @ jacobian.T
        self._later = self._state[:nv] + late_s * self._state[nv:] + added[:, None] * jacobian.T
        self._spread = jacobian @ self._later
        self._held, self._low = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool)
        self.moved = np.zeros((len(jacobian) // 3, 3))
        self.beyond = False

    def spread(self) -> Array:
        """Covariance of each joint's prediction [m2], shape (21, 3, 3)."""
        count = len(self.moved)
        joints = np.arange(count)
        return self._spread.reshape(count, 3, count, 3)[joints, :, joints]

    def solve(self, information: Array, pull: Array, room: Array) -> None:
        """Solve for joints with this information, shape (21, 3, 3), and this pull, (21, 3), from their present place.

        Hinges that the last solve moved beyond their ranges are held at the ends. `room` is the distance to the upper
        and lower ends from the later configuration, shape (2, hinge_count).
        """
        total, wanted, rows = measured_blocks(self._spread, information, pull, self.moved, _LEAST_INFORMATION)
        self._rows, self._fixed = rows, self._held
        if len(rows) == len(self._spread):
            later, self._columns = self._later, self._state
        else:
            later, self._columns = self._later[:, rows], self._state[:, rows]
        if len(self._held):
            total, wanted, later = self._with_held(total, wanted, later, room)
        self._factor, failed = lapack.dpotrf(total.T, lower=1, clean=0, overwrite_a=1)
        if failed:
            raise np.linalg.LinAlgError("not positive definite")
        self._weights, _ = lapack.dpotrs(self._factor, wanted, lower=1)
        step = later @ self._weights
        self.moved = (self._jacobian @ step).reshape(-1, 3)
        hinges = step[FREE_DOFS:]
        beyond = (hinges > room[0] + _TOLERANCE) | (hinges < room[1] - _TOLERANCE)
        self.beyond = bool(beyond.any())
        if self.beyond:
            self._held = np.union1d(self._held, FREE_DOFS + np.flatnonzero(beyond))
            self._low = step[self._held] < 0.0

    def _with_held(
        self, total: Array, wanted: Array, later: Array, room: Array
    ) -> tuple[Array, Array, Array]:
        """The rows with one more for each held hinge."""
        held, count = self._held, len(self._held)
        nv = len(self._added)
        state = self._with_later[:, held]
        columns = state[:nv] + self._late_s * state[nv:]
        columns[held, np.arange(count)] += self._added[held]
        ends = np.where(self._low, room[1, held - FREE_DOFS], room[0, held - FREE_DOFS])
        size = len(total)
        whole = np.empty((size + count, size + count))
        whole[:size, :size] = total
        whole[size:, :size] = later[held]
        whole[:size, size:] = whole[size:, :size].T
        whole[size:, size:] = columns[held]
        whole[np.arange(size, size + count), np.arange(size, size + count)] += _HELD_VARIANCE
        self._columns = np.hstack([self._columns, state])
        return whole, np.concatenate([wanted, ends]), np.hstack([later, columns])

    def step(self) -> Array:
        """Step of configuration and velocity, shape (2 nv,)."""
        return self._columns @ self._weights

    def told(self) -> Array:
        """Information of the joints on configuration and velocity, shape (2 nv,): the step is the covariance times
        it."""
        count = len(self._rows)
        later = self._weights[:count] @ self._jacobian[self._rows]
        later[self._fixed] += self._weights[count:]
        return np.concatenate([later, self._late_s * later])

    def gained(self) -> Array:
        """Reduction of the state's covariance, shape (2 nv, 2 nv), its lower triangle."""
        half = blas.dtrsm(1.0, self._factor, self._columns.T, lower=1)
        return blas.dsyrk(1.0, half, trans=1, lower=1)

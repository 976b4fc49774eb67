"""Normal equations in which each frame couples fully with the next two, and their banded solution."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from studio.engine.whole_take.finish.banded import DAMPING, BandedNormal


@dataclass(frozen=True)
class Blocks:
    """Blocks of the matrix (lower triangle) and the right-hand side, F frames of nv unknowns.

    Attributes:
        diagonal: shape (F, nv, nv).
        next: first unknown of columns t, second of rows t + 1, shape (F - 1, nv, nv).
        second: first of columns t, second of rows t + 2, shape (F - 2, nv, nv).
        right: shape (F, nv).
    """

    diagonal: NDArray[np.float64]
    next: NDArray[np.float64]
    second: NDArray[np.float64]
    right: NDArray[np.float64]

    @classmethod
    def of(cls, normal: BandedNormal) -> "Blocks":
        """Convert finishing's equations, in which a degree of freedom couples only with itself two frames on."""
        frames, nv = normal.right.shape
        second, k = np.zeros((frames - 2, nv, nv)), np.arange(nv)
        second[:, k, k] = normal.second
        return cls(normal.diagonal, normal.next, second, normal.right)

    def add_rows(
        self,
        before: NDArray[np.float64],
        here: NDArray[np.float64],
        after: NDArray[np.float64],
        residual: NDArray[np.float64],
    ) -> None:
        """Add rows over three successive frames: their Jacobians, each (F - 2, m, nv), and residuals, shape (F - 2,
        m)."""
        last = len(self.right) - 2
        for k, rows in enumerate((before, here, after)):
            turned = rows.transpose(0, 2, 1)
            self.diagonal[k : k + last] += turned @ rows
            self.right[k : k + last] -= np.matvec(turned, residual)
        self.next[:-1] += before.transpose(0, 2, 1) @ here
        self.next[1:] += here.transpose(0, 2, 1) @ after
        self.second[:] += before.transpose(0, 2, 1) @ after

    def solve(self) -> NDArray[np.float64]:
        """The unknowns, shape (F, nv)."""
        frames, nv = self.right.shape
        columns = np.zeros((frames, nv, 3 * nv))  # LAPACK's columns: diagonal, then entries below
        for j in range(nv):
            columns[:, j, : nv - j] = self.diagonal[:, j, j:]
            columns[:-1, j, nv - j : 2 * nv - j] = self.next[:, j]
            columns[:-2, j, 2 * nv - j : 3 * nv - j] = self.second[:, j]
        columns[:, :, 0] += DAMPING
        band = columns.reshape(frames * nv, -1).T
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
        return cho_solve_banded((factor, True), self.right.ravel(), check_finite=False).reshape(frames, nv)

"""Normal equations of many frames, of which each couples with the next two: a banded matrix, and its solution."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

DAMPING = 3.0
"""Damping, which keeps steps where the linear model holds [1/rad2]."""


class NormalEquations(Protocol):
    """Normal equations of frames' steps: the diagonal blocks of the matrix (lower triangle), the right-hand side, and
    their solution, shape (frame_count, nv)."""

    @property
    def diagonal(self) -> NDArray[np.float64]: ...
    @property
    def right(self) -> NDArray[np.float64]: ...
    def solve(self) -> NDArray[np.float64]: ...


class BandedNormal:
    """The normal equations: blocks of the matrix (lower triangle) and the right-hand side."""

    def __init__(self, diagonal: NDArray[np.float64], right: NDArray[np.float64]) -> None:
        frames, nv = right.shape
        self.diagonal = diagonal  # (frame_count, nv, nv)
        self.right = right  # (frame_count, nv)
        self.next = np.zeros((frames - 1, nv, nv))  # columns t (first), rows t + 1
        self.second = np.zeros((frames - 2, nv))  # diagonal of rows t + 2, columns t

    def solve(self) -> NDArray[np.float64]:
        """The steps, shape (frame_count, nv)."""
        frames, nv = self.right.shape
        columns = np.zeros(
            (frames, nv, 2 * nv + 1)
        )  # in LAPACK's column order: the diagonal, then the entries below it
        for j in range(nv):
            columns[:, j, : nv - j] = self.diagonal[:, j, j:]
            columns[:-1, j, nv - j : 2 * nv - j] = self.next[:, j]
        columns[:-2, :, 2 * nv] = self.second
        columns[:, :, 0] += DAMPING
        band = columns.reshape(frames * nv, -1).T
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
        return cho_solve_banded((factor, True), self.right.ravel(), check_finite=False).reshape(frames, nv)


def add_accelerations(
    normal: BandedNormal, acceleration: NDArray[np.float64], stiffness: NDArray[np.float64]
) -> None:
    """Add the accelerations of all degrees of freedom, with their stiffness, both of shape (frame_count - 2, nv)."""
    pull = stiffness * acceleration
    normal.right[:-2] -= pull
    normal.right[1:-1] += 2.0 * pull
    normal.right[2:] -= pull
    k = np.arange(stiffness.shape[1])
    for rows, factor in ((slice(None, -2), 1.0), (slice(1, -1), 4.0), (slice(2, None), 1.0)):
        normal.diagonal[rows, k, k] += factor * stiffness
    normal.next[:-1, k, k] -= 2.0 * stiffness
    normal.next[1:, k, k] -= 2.0 * stiffness
    normal.second += stiffness


def add_rows(
    normal: NormalEquations,
    frames: NDArray[np.int64],
    rows: NDArray[np.float64],
    residuals: NDArray[np.float64],
) -> None:
    """Add rows, shape (row_count, nv), each of one frame, with their residuals, shape (row_count,)."""
    for frame, row, residual in zip(frames.tolist(), rows, residuals, strict=True):
        normal.diagonal[frame] += np.outer(row, row)
        normal.right[frame] += residual * row

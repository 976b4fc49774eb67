"""What the studio uses of `scipy.linalg`, which brings no types of its own."""

from numpy import float64
from numpy.typing import NDArray

from . import blas as blas
from . import lapack as lapack

Array = NDArray[float64]

def cholesky_banded(
    ab: Array, overwrite_ab: bool = False, lower: bool = False, check_finite: bool = True
) -> Array: ...
def cho_solve_banded(
    cb_and_lower: tuple[Array, bool], b: Array, overwrite_b: bool = False, check_finite: bool = True
) -> Array: ...

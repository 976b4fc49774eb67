"""What the studio uses of `scipy.linalg.lapack`, which is made when it is imported."""

from numpy import float64
from numpy.typing import NDArray

Array = NDArray[float64]

def dpotrf(a: Array, *, lower: int = 0, clean: int = 1, overwrite_a: int = 0) -> tuple[Array, int]: ...
def dpotrs(c: Array, b: Array, *, lower: int = 0) -> tuple[Array, int]: ...

"""What the studio uses of `scipy.linalg.blas`, which is made when it is imported."""

from numpy import float64
from numpy.typing import NDArray

Array = NDArray[float64]

def dtrsm(alpha: float, a: Array, b: Array, *, lower: int = 0) -> Array: ...
def dsyrk(alpha: float, a: Array, *, trans: int = 0, lower: int = 0) -> Array: ...

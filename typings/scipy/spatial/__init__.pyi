"""What the studio uses of `scipy.spatial`, whose trees are compiled; `scipy.spatial.transform` has its own types."""

from collections.abc import Sequence

from numpy import float64, int64
from numpy.typing import NDArray

class cKDTree:
    def __init__(self, data: NDArray[float64]) -> None: ...
    def query(self, x: NDArray[float64], k: Sequence[int]) -> tuple[NDArray[float64], NDArray[int64]]: ...

class ConvexHull:
    def __init__(self, points: NDArray[float64]) -> None: ...
    @property
    def simplices(self) -> NDArray[int64]: ...
    @property
    def equations(self) -> NDArray[float64]: ...

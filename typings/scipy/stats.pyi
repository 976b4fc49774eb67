"""What the studio uses of `scipy.stats`; the types of its tuples cannot be told from its code."""

from typing import Literal, NamedTuple

from numpy import float64
from numpy.typing import NDArray

class Interval(NamedTuple):
    low: float
    high: float

class BinomTestResult:
    pvalue: float
    def proportion_ci(
        self, confidence_level: float = 0.95, method: Literal["exact", "wilson", "wilsoncc"] = "exact"
    ) -> Interval: ...

def binomtest(k: int, n: int, p: float = 0.5) -> BinomTestResult: ...
def theilslopes(y: NDArray[float64], x: NDArray[float64]) -> tuple[float, float, float, float]: ...

"""What the studio uses of `scipy.signal`, which brings no types of its own."""

from typing import Literal

from numpy import float64, int64
from numpy.typing import NDArray

Array = NDArray[float64]
Mode = Literal["full", "valid", "same"]

def butter(N: int, Wn: float, *, fs: float, output: Literal["sos"]) -> Array: ...
def correlate(in1: Array, in2: Array, mode: Mode = "full") -> Array: ...
def correlation_lags(in1_len: int, in2_len: int, mode: Mode = "full") -> NDArray[int64]: ...
def sosfiltfilt(sos: Array, x: Array, axis: int = -1, *, padlen: int | None = None) -> Array: ...

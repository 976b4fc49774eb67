"""A filter of one's own as a value of the `smoothing` switch: the median of three frames, after the solve.

python examples/own_filter.py TAKE
"""

import sys

import numpy as np
from numpy.typing import NDArray

import studio


class MedianOfThree:
    """The median of the last three frames: a single spike does not pass."""

    def __init__(self) -> None:
        self._last: list[NDArray[np.float64]] = []

    def apply(self, values: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return the filtered rows, shape (row_count, value_count); NaN = unseen."""
        self._last = [*self._last[-2:], values]
        return np.median(np.stack(self._last), axis=0)


def jerk_m_s3(poses: studio.Poses) -> float:
    """Return the median jerk of all joints [m/s3]."""
    return float(np.median(np.linalg.norm(np.diff(poses.positions_m, 3, axis=0), axis=-1)) * 60.0**3)


def main(take_path: str) -> None:
    take = studio.open_take(take_path)
    studio.add_filter("median_of_three", MedianOfThree)
    for smoothing in ("none", "median_of_three:after"):
        settings = studio.settings("thesis", {"smoothing": smoothing})
        poses = studio.solve(take, settings, name=smoothing.replace(":", "_"))
        print(f"smoothing={smoothing}: jerk {jerk_m_s3(poses):.0f} m/s3")


if __name__ == "__main__":
    main(sys.argv[1])

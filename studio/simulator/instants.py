"""Capture times of a simulated camera."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.simulator.clock import jitter_s

_START_S = 0.2
"""Earliest time of a frame, so that no camera clock is negative."""


def instants(rng: np.random.Generator, end_s: float, frames_per_second: float) -> NDArray[np.float64]:
    """Return a camera's capture times [s]; cameras are not triggered together.

    Raises:
        FormatError: `end_s` leaves no frame.
    """
    start = _START_S + rng.uniform(0, 1 / frames_per_second)
    count = int((end_s - start) * frames_per_second)
    if count < 1:
        raise FormatError(
            "simulator.short_motion",
            "a motion of {seconds:.2f} s is too short to be recorded; give one of at least 0.3 s",
            seconds=end_s,
        )
    return start + np.arange(count) / frames_per_second + np.array([jitter_s(rng) for _ in range(count)])

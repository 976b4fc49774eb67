"""The clock and the trigger of a simulated camera."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_OFFSET_S = 0.15
_DRIFT_PPM = 100.0
_JITTER_S = 0.003


@dataclass(frozen=True)
class SimulatedClock:
    """device time = time + offset_s + drift_ppm * 1e-6 * (time - since_s), all in seconds."""

    offset_s: float = 0.0
    drift_ppm: float = 0.0
    since_s: float = 0.0

    def device_s(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return this clock's times at true times, any shape."""
        return time_s + self.offset_s + self.drift_ppm * 1e-6 * (time_s - self.since_s)

    def device_ns(self, time_ns: int) -> int:
        """Return this clock's time at a true time, exact to the nanosecond."""
        since = time_ns - round(self.since_s * 1e9)
        return time_ns + round(self.offset_s * 1e9) + round(self.drift_ppm * 1e-6 * since)


def random_clock(rng: np.random.Generator, since_s: float = 0.0) -> SimulatedClock:
    """Return a clock with an error of up to 150 ms and 100 ppm."""
    return SimulatedClock(rng.uniform(-_OFFSET_S, _OFFSET_S), rng.uniform(-_DRIFT_PPM, _DRIFT_PPM), since_s)


def jitter_s(rng: np.random.Generator) -> float:
    """Return the trigger jitter of a frame [s]: SD 3 ms, at most 12 ms, so that frames stay in order."""
    return float(np.clip(rng.normal(0.0, _JITTER_S), -0.012, 0.012))

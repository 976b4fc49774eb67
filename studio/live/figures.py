"""How the live pipeline does: its rate, and how long a step takes."""

from collections import deque
from typing import Any

import numpy as np


class PipelineFigures:
    """Counts steps; times are on the server's clock [ns].

    Attributes:
        steps: made so far.
        left_out: output frames that were due but not made, since the pipeline was behind.
        failures: times that the pipeline raised an error and was started afresh.
    """

    def __init__(self) -> None:
        self.steps = 0
        self.left_out = 0
        self.failures = 0
        self._ends_ns: deque[int] = deque(maxlen=240)
        self._steps_ms: deque[float] = deque(maxlen=240)

    def stepped(self, begin_ns: int, end_ns: int) -> None:
        """Count a step of the pipeline."""
        self.steps += 1
        self._ends_ns.append(end_ns)
        self._steps_ms.append((end_ns - begin_ns) * 1e-6)

    def status(self, now_ns: int) -> dict[str, Any]:
        """Return the pipeline's part of the status; the rate is of the last two seconds."""
        recent = sum(1 for end in self._ends_ns if now_ns - end < 2_000_000_000)
        times = np.array(self._steps_ms) if self._steps_ms else None
        return {
            "rate_hz": round(recent / 2.0, 1),
            "step_ms_median": None if times is None else round(float(np.median(times)), 3),
            "step_ms_p99": None if times is None else round(float(np.percentile(times, 99)), 3),
            "steps": self.steps,
            "left_out": self.left_out,
            "failures": self.failures,
        }

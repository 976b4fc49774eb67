"""Figures of the live pipeline: its rate, and the time of a step."""

from collections import deque

import numpy as np

from studio.live.states import PipelineStatus


class PipelineFigures:
    """Counts steps; times are on the server's clock [ns].

    Attributes:
        steps: number so far.
        left_out: due output frames that were not made, because the pipeline was behind.
        failures: number of errors after which the pipeline was started afresh.
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

    def status(self, now_ns: int) -> PipelineStatus:
        """Return the pipeline's part of the status; the rate is of the last two seconds."""
        recent = sum(1 for end in self._ends_ns if now_ns - end < 2_000_000_000)
        times = np.array(self._steps_ms) if self._steps_ms else None
        return PipelineStatus(
            rate_hz=round(recent / 2.0, 1),
            step_ms_median=None if times is None else round(float(np.median(times)), 3),
            step_ms_p99=None if times is None else round(float(np.percentile(times, 99)), 3),
            steps=self.steps,
            left_out=self.left_out,
            failures=self.failures,
        )

"""What limits a camera client: how much of the last seconds went into computing, and how much into sending."""

import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from studio.engine.system import queued_ns

_WINDOW_NS = 3_000_000_000


class _Sample(NamedTuple):
    at_ns: int
    tracked_ns: int
    used_ns: int
    sent_ns: int


def processor_ns() -> int:
    """Return the time that this process has computed, or waited for a processor where the system tells it [ns]."""
    return time.process_time_ns() + queued_ns()


class Workload:
    """Shares of the last three seconds, measured whenever they are asked for.

    Args:
        tracked_ns: returns how long the tracker has been busy in all [ns].
        clock_ns: the time [ns].
        used_ns: returns what this process has used of processors in all [ns].
    """

    def __init__(
        self,
        tracked_ns: Callable[[], int],
        *,
        clock_ns: Callable[[], int] = time.monotonic_ns,
        used_ns: Callable[[], int] = processor_ns,
    ) -> None:
        self._tracked_ns, self._clock_ns, self._used_ns = tracked_ns, clock_ns, used_ns
        self._sent_ns = 0
        self._samples: deque[_Sample] = deque([self._now()])

    def sent(self, begin_ns: int) -> None:
        """Count a message that was handed to the network from `begin_ns` [ns] until now."""
        self._sent_ns += self._clock_ns() - begin_ns

    def shares(self) -> tuple[int, int]:
        """Return how busy processor and link are [%].

        The processor's share is that of the tracker, which works on one image at a time, or of this process, where
        that is larger. The link's is that of the time in which a message waited to be taken by the network.
        """
        now = self._now()
        self._samples.append(now)
        while len(self._samples) > 2 and now.at_ns - self._samples[1].at_ns > _WINDOW_NS:
            self._samples.popleft()
        then = self._samples[0]
        passed = max(now.at_ns - then.at_ns, 1)
        busy = max(now.tracked_ns - then.tracked_ns, now.used_ns - then.used_ns) / passed
        sending = (now.sent_ns - then.sent_ns) / passed
        return round(100 * min(busy, 1.0)), round(100 * min(sending, 1.0))

    def _now(self) -> _Sample:
        return _Sample(self._clock_ns(), self._tracked_ns(), self._used_ns(), self._sent_ns)

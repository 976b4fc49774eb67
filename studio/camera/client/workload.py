"""Workload of a camera client: the shares of the last seconds spent on computing and on sending."""

import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from studio.engine.base.system import queued_ns

_WINDOW_NS = 3_000_000_000


class _LoadSample(NamedTuple):
    at_ns: int
    tracked_ns: int
    used_ns: int
    sent_ns: int


def processor_ns() -> int:
    """Return the time that this process has computed, or waited for a processor if the system reports it [ns]."""
    return time.process_time_ns() + queued_ns()


class Workload:
    """Shares of the last three seconds, measured when they are requested.

    Args:
        tracked_ns: returns the tracker's total busy time [ns].
        clock_ns: the time [ns].
        used_ns: returns this process's total processor time [ns].
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
        self._samples: deque[_LoadSample] = deque([self._now()])

    def sent(self, begin_ns: int) -> None:
        """Count a message that was passed to the network from `begin_ns` [ns] until now."""
        self._sent_ns += self._clock_ns() - begin_ns

    def shares(self) -> tuple[int, int]:
        """Return the load of processor and link [%].

        The processor's load is that of the tracker, which works on one image at a time, or that of this process, if
        larger. The link's is the share of time in which a message waited for the network.
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

    def _now(self) -> _LoadSample:
        return _LoadSample(self._clock_ns(), self._tracked_ns(), self._used_ns(), self._sent_ns)

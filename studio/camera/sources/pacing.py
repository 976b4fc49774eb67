"""The wall clock of a camera client, and waiting for one of its instants."""

import asyncio
import time


class WallClock:
    """Time since 1970 [ns], read once at the start and continued by a clock that never jumps.

    Clients on one machine, or on machines with synchronised clocks, agree on it.
    """

    def __init__(self) -> None:
        self._start_ns = time.time_ns()
        self._monotonic_ns = time.monotonic_ns()

    @property
    def start_ns(self) -> int:
        """Time at which this clock was made."""
        return self._start_ns

    def now_ns(self) -> int:
        return self._start_ns + time.monotonic_ns() - self._monotonic_ns

    async def wait_until(self, time_ns: int) -> None:
        """Return at `time_ns`, or at once if it is past."""
        await asyncio.sleep(max(time_ns - self.now_ns(), 0) * 1e-9)

"""The schedule of output frames: part of step 3, for live and replay."""

from studio.engine.model.settings.settings import SolveSettings

MAX_WAIT_NS = 80_000_000
"""Live, the longest wait for a camera that lags."""

ACTIVE_NS = 500_000_000
"""A camera is inactive if its newest frame is older than the newest of all by more than this."""

START_NS = 100_000_000
"""Delay of the first output frame, so that all cameras decide where the performer stands and which side is left."""

AHEAD_NS = 10_000_000_000
"""A frame this far ahead of all before it counts only when another follows, because a clock may be wrong once."""

BACK_NS = 1_000_000_000
"""If frames are this far behind the next output frame, time has gone back, and output continues from there."""


class Schedule:
    """Decides which output frames are due.

    An output frame is due once every active camera has delivered a frame at or after it (so that frames are
    interpolated, not extrapolated), or, live, once it is `MAX_WAIT_NS` old. Output times are multiples of the
    output period on the stage clock.
    """

    def __init__(self, output_hz: int, *, ahead_ns: int = 0) -> None:
        """`ahead_ns`: look-ahead of the cameras' frames beyond an output frame [ns]."""
        self._output_hz, self._ahead_ns = output_hz, ahead_ns
        self._waits_ns = ACTIVE_NS
        self._next: int | None = None
        self._first_ns: int | None = None
        self._ready_ns: int | None = None
        self._held_back_ns: int | None = None

    @classmethod
    def of(cls, settings: SolveSettings) -> "Schedule":
        """The schedule of a solve."""
        return cls(settings.output_hz, ahead_ns=settings.ahead_ns)

    def _time_ns(self, index: int) -> int:
        return index * 1_000_000_000 // self._output_hz

    def due(self, newest_stage_ns: dict[str, int], now_stage_ns: int | None = None) -> list[int]:
        """Return the stage times [ns] to step now, in order; each is returned once.

        Args:
            newest_stage_ns: stage time of each camera's newest frame.
            now_stage_ns: the present on the stage clock, live; None in replay.
        """
        times_ns = self._possible(list(newest_stage_ns.values()))
        if not times_ns:
            return []
        newest = max(times_ns)
        ready = min(t for t in times_ns if newest - t <= self._waits_ns)
        if now_stage_ns is not None:
            ready = max(ready, min(newest, now_stage_ns - MAX_WAIT_NS))
        ready -= self._ahead_ns
        self._ready_ns = ready
        if self._next is None and not self._started(newest):
            return []
        last = ready * self._output_hz // 1_000_000_000
        assert self._next is not None
        if not -4 * ACTIVE_NS <= self._time_ns(self._next) - ready <= BACK_NS:
            self._next = last  # a long gap, or time that went back
        times = [self._time_ns(i) for i in range(self._next, last + 1)]
        self._next = max(self._next, last + 1)
        return times

    def rest(self, newest_stage_ns: dict[str, int]) -> list[int]:
        """Return the remaining stage times [ns] at the end of a take.

        A camera that lost the performer up to half a second before the end is not waited for: it sends nothing more.
        """
        self._ahead_ns, self._waits_ns = 0, MAX_WAIT_NS
        return self.due(newest_stage_ns)

    def _started(self, newest_ns: int) -> bool:
        """Whether every camera has had time to show the performer; output then begins with the first frame."""
        if self._first_ns is None or newest_ns < self._first_ns:
            self._first_ns = newest_ns
        if newest_ns - self._first_ns < START_NS:
            return False
        self._next = self._first_ns * self._output_hz // 1_000_000_000
        return True

    def _possible(self, times_ns: list[int]) -> list[int]:
        """The times without those that are far ahead and not yet followed by another."""
        if self._ready_ns is None:
            return times_ns
        latest = self._ready_ns + AHEAD_NS
        ahead = max(times_ns, default=latest)
        if ahead <= latest:
            self._held_back_ns = None
            return times_ns
        followed = self._held_back_ns is not None and 0 < ahead - self._held_back_ns <= AHEAD_NS
        if followed:
            return times_ns
        self._held_back_ns = ahead
        return [t for t in times_ns if t <= latest]

"""When the next output frame is due: part of step 3, for live and replay alike."""

MAX_WAIT_NS = 80_000_000
"""Live, a camera that lags by more than this is not waited for."""

ACTIVE_NS = 500_000_000
"""A camera whose newest frame is older than this beside the newest of all is not active."""


class Schedule:
    """Says which output frames can be made now.

    An output frame is due once every active camera has delivered a frame at or after it (so that frames are
    interpolated, not extrapolated), or, live, once it is `MAX_WAIT_NS` old. Output times are multiples of the
    output period on the stage clock.
    """

    def __init__(self, output_hz: int) -> None:
        self._output_hz = output_hz
        self._next: int | None = None

    def _time_ns(self, index: int) -> int:
        return index * 1_000_000_000 // self._output_hz

    def due(self, newest_stage_ns: dict[str, int], now_stage_ns: int | None = None) -> list[int]:
        """Return the stage times [ns] to step now, in order; each is returned once.

        Args:
            newest_stage_ns: stage time of each camera's newest frame.
            now_stage_ns: the present on the stage clock, live; None in replay.
        """
        if not newest_stage_ns:
            return []
        newest = max(newest_stage_ns.values())
        ready = min(t for t in newest_stage_ns.values() if newest - t <= ACTIVE_NS)
        if now_stage_ns is not None:
            ready = max(ready, min(newest, now_stage_ns - MAX_WAIT_NS))
        last = ready * self._output_hz // 1_000_000_000
        if (
            self._next is None or self._time_ns(self._next) < ready - 4 * ACTIVE_NS
        ):  # the start, or a long gap
            self._next = last
        times = [self._time_ns(i) for i in range(self._next, last + 1)]
        self._next = max(self._next, last + 1)
        return times

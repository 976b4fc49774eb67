"""Time from the first to the last frame of a recording. Late frames count at their capture time."""

Key = tuple[str, str]
"""Camera and start of its client (boot id)."""


class RawSpan:
    """Collects the times of a recording's frames and of its live log; `ends` are on the server's clock [ns]."""

    def __init__(self) -> None:
        self._first_ns: int | None = None
        self._last_ns: int | None = None
        self._log_ns: int | None = None
        self._ahead_ns: dict[Key, tuple[int, int]] = {}
        self._late: dict[Key, tuple[int, int, int]] = {}

    def event(self, time_ns: int) -> None:
        """Add an event of the live log."""
        self._log_ns = time_ns if self._log_ns is None else max(time_ns, self._log_ns)

    def frame(self, key: Key, arrival_ns: int, taken_ns: int, *, late: bool) -> None:
        """Add a frame or an image: its arrival, and its capture time on the camera's clock."""
        if late:
            first, last, newest = self._late.get(key, (taken_ns, taken_ns, arrival_ns))
            self._late[key] = (min(first, taken_ns), max(last, taken_ns), max(newest, arrival_ns))
            return
        self._include(arrival_ns)
        if key not in self._ahead_ns or taken_ns >= self._ahead_ns[key][0]:
            self._ahead_ns[key] = (taken_ns, arrival_ns - taken_ns)

    def ends(self) -> tuple[int, int] | None:
        """Return the first and the last time [ns], None without frames."""
        for key, (first, last, newest) in self._late.items():
            _, ahead_ns = self._ahead_ns.get(key, (last, newest - last))
            for time_ns in (first + ahead_ns, last + ahead_ns):
                self._include(time_ns if self._log_ns is None else min(time_ns, self._log_ns))
        return None if self._first_ns is None or self._last_ns is None else (self._first_ns, self._last_ns)

    def _include(self, time_ns: int) -> None:
        self._first_ns = time_ns if self._first_ns is None else min(time_ns, self._first_ns)
        self._last_ns = time_ns if self._last_ns is None else max(time_ns, self._last_ns)

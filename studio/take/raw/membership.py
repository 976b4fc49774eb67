"""Membership of frames in a recording: those that its own cameras took between its beginning and its end.

A camera's own frames are those of the starts of its client that joined the recording, according to the log: (name,
boot id), never the name alone. The clocks in the log give the time of a frame. A frame of unknown time does not
belong.
"""

from studio.take.raw.append import RawState
from studio.take.raw.clocks import TakeClocks
from studio.take.raw.live_log import JoinedEvent, StageClockEvent, StoppedEvent

Key = tuple[str, str]
"""Camera and start of its client (boot id)."""

BEGIN_NS = 2_000_000_000
"""Maximum time before a recording of its first frames, which were in transit [ns]."""

END_NS = 50_000_000
"""Maximum time after its end of a recording's frames, because clocks are not exact [ns]."""

STRANGER = "of a client that took no part in the recording"
BEFORE, AFTER = "taken before its beginning", "taken after its end"
UNTIMED = "no clock in its log tells when they were taken"


class Membership:
    """Decides which frames belong to a recording that has ended.

    Args:
        state: of its `raw.mcap`.
    """

    def __init__(self, state: RawState) -> None:
        self._clocks = TakeClocks()
        for _, event in state.events:
            self._clocks.event(event)
        joined = joined_starts(state)
        self._first = {key: joined[key] for key in state.arrived}
        self._last = {key: ranges.last for key, ranges in state.arrived.items() if ranges.last is not None}
        self._begin_ns, self._end_ns = _bounds(state)
        self._after: dict[Key, int] = {}

    def joined(self, key: Key) -> bool:
        """Whether this start of a client took part."""
        return key in self._first

    def first(self, key: Key) -> int:
        """Return the first sequence that may belong, for a start that has joined."""
        return self._first[key]

    def ends_before(self, key: Key) -> int | None:
        """Return the sequence from which no frame of this start belongs, None if unknown."""
        return self._after.get(key)

    def refusal(self, key: Key, sequence: int, device_time_ns: int) -> str:
        """Return why a frame does not belong, "" if it does; its time is on the camera's clock [ns]."""
        if key not in self._first:
            return STRANGER
        if sequence < self._first[key]:
            return BEFORE
        if sequence >= self._after.get(key, sequence + 1):
            return AFTER
        if sequence <= self._last.get(key, -1):
            return ""  # a later one came before the end
        taken_ns = self._clocks.stage_ns(key[0], key[1], sequence, device_time_ns)
        if taken_ns is None or self._begin_ns is None or self._end_ns is None:
            return UNTIMED
        if taken_ns > self._end_ns + END_NS:
            self._after[key] = sequence  # sequences grow with time
            return AFTER
        return BEFORE if taken_ns < self._begin_ns - BEGIN_NS else ""

    def refusal_of_span(self, key: Key, sequence: int, first_ns: int, last_ns: int) -> str:
        """Return why a client's data of a span does not belong, "" if a part of it does.

        Args:
            key: start of the client.
            sequence: number of a frame of landmarks from that time, whose clock counts.
            first_ns, last_ns: beginning and end on the camera's clock [ns].
        """
        if key not in self._first:
            return STRANGER
        begin_ns, end_ns = (self._clocks.stage_ns(*key, sequence, at_ns) for at_ns in (first_ns, last_ns))
        if begin_ns is None or end_ns is None or self._begin_ns is None or self._end_ns is None:
            return UNTIMED
        if begin_ns > self._end_ns + END_NS:
            return AFTER
        return BEFORE if end_ns < self._begin_ns - BEGIN_NS else ""


def joined_starts(state: RawState) -> dict[Key, int]:
    """Return every start of a client in the log, with its first sequence that may belong to the recording."""
    out = {key: ranges.first or 0 for key, ranges in state.arrived.items()}
    for _, event in reversed(state.events):
        if isinstance(event, JoinedEvent):
            out[event.camera, event.boot_id] = event.from_sequence
    return out


def stage_ns(state: RawState, server_ns: int) -> int | None:
    """Return a time on the server's clock [ns] on the stage clock of a recording; None if it had none."""
    event = state.last_event(StageClockEvent)
    return None if event is None else event.model.stage_ns(server_ns)


def _bounds(state: RawState) -> tuple[int | None, int | None]:
    """Beginning and end on the stage clock [ns]; without a logged end, the last time in the log."""
    if not state.events:
        return None, None
    stopped = state.last_event(StoppedEvent)
    end_ns = stage_ns(state, state.newest_ns) if stopped is None else stopped.stage_time_ns
    return stage_ns(state, state.events[0][0]), end_ns

"""Clocks of a live take's frames: one per start of a client, another after every jump of its clock.

The live log has the map from each clock to the stage clock. Frames are converted to the camera's last clock, that of
the take's calibration, so that every reader of a take sees one clock per camera.
"""

from studio.engine.model.frames import ClockModel
from studio.engine.solve.timing.clock import invert
from studio.take.raw.live_log import ClockEvent, LiveEvent, SegmentEvent

_LARGEST_NS = 2**62
"""Limit of the wire format, so that times of a wrong clock still fit into 64 bits."""


class TakeClocks:
    """Collects the clocks of a take from its live log, then converts times of frames."""

    def __init__(self) -> None:
        self._clocks: dict[tuple[str, str], ClockModel] = {}
        self._last: dict[str, str] = {}
        self._segments: dict[tuple[str, str], list[tuple[int, str]]] = {}
        self._first: dict[tuple[str, str], str] = {}

    def event(self, event: LiveEvent) -> None:
        """Take in an event of the live log; events without cameras' clocks are ignored."""
        if isinstance(event, SegmentEvent):
            segments = self._segments.setdefault((event.camera, event.boot_id), [])
            segments.append((event.from_sequence, event.clock_id))
        elif isinstance(event, ClockEvent) and event.clock_id is not None:
            self._clocks[event.camera, event.clock_id] = event.model
            self._last[event.camera] = event.clock_id
            self._first.setdefault((event.camera, event.clock_id.partition("#")[0]), event.clock_id)

    def clock_id(self, camera: str, boot_id: str, sequence: int) -> str:
        """Return the id of a frame's clock; for a clock that jumped before the take, the first one in the log."""
        segments = self._segments.get((camera, boot_id), [])
        own = self._first.get((camera, boot_id), boot_id)
        return next((name for first, name in reversed(segments) if sequence >= first), own)

    def stage_ns(self, camera: str, boot_id: str, sequence: int, device_time_ns: int) -> int | None:
        """Return a frame's time on the stage clock [ns]; None if its clock is unknown."""
        clock = self._clocks.get((camera, self.clock_id(camera, boot_id, sequence)))
        return None if clock is None else clock.stage_ns(device_time_ns)

    def placed_ns(self, camera: str, boot_id: str, sequence: int, device_time_ns: int) -> int | None:
        """Return a frame's or image's time on the camera's last clock [ns]; None if its own is unknown."""
        last = self._last.get(camera)
        own = self.clock_id(camera, boot_id, sequence)
        if last is None or own == last:
            return device_time_ns
        clock = self._clocks.get((camera, own))
        if clock is None:
            return None
        placed = invert(self._clocks[camera, last]).stage_ns(clock.stage_ns(device_time_ns))
        return max(-_LARGEST_NS, min(placed, _LARGEST_NS))

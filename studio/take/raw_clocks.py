"""Which clock stamped each frame of a live take: one per start of a client, another after every jump of it.

The live log tells how each clock maps to the stage clock. Frames are brought to the camera's last clock, the one
that the take's calibration knows, so that whatever reads a take meets one clock per camera.
"""

from typing import Any

from studio.engine.clock import invert
from studio.engine.frames import ClockModel

_LARGEST_NS = 2**62
"""As the wire allows: times of a clock that is far off still fit into 64 bits."""


class TakeClocks:
    """Collects the clocks of a take from its live log, then places frames."""

    def __init__(self) -> None:
        self._clocks: dict[tuple[str, str], ClockModel] = {}
        self._last: dict[str, str] = {}
        self._segments: dict[tuple[str, str], list[tuple[int, str]]] = {}

    def event(self, event: dict[str, Any]) -> None:
        """Take in an event of the live log; those that tell nothing of clocks are passed over."""
        kind, camera, clock_id = event.get("type"), event.get("camera"), event.get("clock_id")
        if camera is None or clock_id is None:
            return
        if kind == "clock":
            clock = ClockModel(event["offset_ns"], event["drift_ppm"], event["reference_ns"])
            self._clocks[camera, clock_id] = clock
            self._last[camera] = clock_id
        elif kind == "segment":
            segments = self._segments.setdefault((camera, event["boot_id"]), [])
            segments.append((event["from_sequence"], clock_id))

    def clock_id(self, camera: str, boot_id: str, sequence: int) -> str:
        """Return which clock stamped a frame."""
        segments = self._segments.get((camera, boot_id), [])
        return next((name for first, name in reversed(segments) if sequence >= first), boot_id)

    def placed_ns(self, camera: str, boot_id: str, sequence: int, device_time_ns: int) -> int | None:
        """Return a frame's or image's time on the camera's last clock [ns]; None where its own is not known."""
        last = self._last.get(camera)
        own = self.clock_id(camera, boot_id, sequence)
        if last is None or own == last:
            return device_time_ns
        clock = self._clocks.get((camera, own))
        if clock is None:
            return None
        placed = invert(self._clocks[camera, last]).stage_ns(clock.stage_ns(device_time_ns))
        return max(-_LARGEST_NS, min(placed, _LARGEST_NS))

"""The mark of a recording under way, `sessions/recording.json`, with which a restarted server continues that take.

The mark is written when a take begins and removed when it is saved. It also relates the server's clock to the wall
clock, so that the clock continues after a restart of the machine.
"""

import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from studio.engine.base.files import write_json
from studio.engine.base.system import boot_id
from studio.take.folder.names import is_safe_name

MARKER = "recording.json"
RECORDING, STOPPING = "recording", "stopping"


class Restart(msgspec.Struct, frozen=True):
    """A restart of the server within a take: its time (UTC), and the time that was not recorded until then [ms]."""

    at: str
    gap_ms: int


class RecordingMarker(msgspec.Struct, frozen=True):
    """A recording under way.

    Attributes:
        session, take, take_id: the take.
        state: `recording`, or `stopping` once its end was requested.
        began_ns: beginning on the server's clock [ns].
        server_ns, wall_ns: one instant on the server's clock and on the wall clock [ns].
        machine: identifier of this boot of the machine; empty where the system has none.
        restarts: earlier restarts of the server within the take.
    """

    session: str
    take: str
    take_id: str
    state: str
    began_ns: int
    server_ns: int
    wall_ns: int
    machine: str
    restarts: tuple[Restart, ...] = ()

    def path(self, sessions: Path) -> Path:
        """The take's folder."""
        return sessions / self.session / self.take

    def clock_offset_ns(self, clock_ns: Callable[[], int]) -> int:
        """Offset that continues the recording's clock, added to the server's clock [ns]."""
        if self.machine and self.machine == machine():
            return 0
        return self.server_ns + time.time_ns() - self.wall_ns - clock_ns()


def machine() -> str:
    """Return the identifier of this boot of the machine; empty where the system has none."""
    return boot_id()


def write_marker(sessions: Path, marker: RecordingMarker) -> None:
    """Write the mark atomically.

    Raises:
        StudioError: the folder cannot be written.
    """
    write_json(sessions / MARKER, msgspec.to_builtins(marker))


def remove_marker(sessions: Path) -> None:
    """Remove the mark, if there is one."""
    (sessions / MARKER).unlink(missing_ok=True)


def read_marker(sessions: Path) -> RecordingMarker | None:
    """Return the mark; None if there is none, or it cannot be read."""
    try:
        marker = msgspec.json.decode((sessions / MARKER).read_bytes(), type=RecordingMarker)
    except (OSError, msgspec.DecodeError):
        return None
    return marker if is_safe_name(marker.session) and is_safe_name(marker.take) else None

"""The mark of a recording under way, `sessions/recording.json`: a server that starts again goes on with that take.

The mark is made when a take begins and removed when it is saved. It also ties the server's clock to the wall clock,
so that the clock goes on where the machine itself was started anew.
"""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from studio.engine.files import write_json
from studio.engine.system import boot_id
from studio.take.names import is_safe_name

MARKER = "recording.json"
RECORDING, STOPPING = "recording", "stopping"


@dataclass(frozen=True)
class Marker:
    """A recording under way.

    Attributes:
        session, take, take_id: the take.
        state: `recording`, or `stopping` once its end was asked for.
        began_ns: beginning on the server's clock [ns].
        server_ns, wall_ns: one instant on the server's clock and on the wall clock [ns].
        machine: names this start of the machine; empty where the system does not tell.
        restarts: earlier restarts of the server within the take, each with `at` (UTC) and `gap_ms`.
    """

    session: str
    take: str
    take_id: str
    state: str
    began_ns: int
    server_ns: int
    wall_ns: int
    machine: str
    restarts: tuple[dict[str, Any], ...] = ()

    def path(self, sessions: Path) -> Path:
        """The take's folder."""
        return sessions / self.session / self.take

    def clock_offset_ns(self, clock_ns: Callable[[], int]) -> int:
        """How far the server's clock must be put forward to go on with that of the recording [ns]."""
        if self.machine and self.machine == machine():
            return 0
        return self.server_ns + time.time_ns() - self.wall_ns - clock_ns()


def machine() -> str:
    """Return what names this start of the machine; empty where the system does not tell."""
    return boot_id()


def write_marker(sessions: Path, marker: Marker) -> None:
    """Write the mark atomically.

    Raises:
        StudioError: the folder cannot be written.
    """
    write_json(sessions / MARKER, asdict(marker))


def remove_marker(sessions: Path) -> None:
    """Remove the mark, where there is one."""
    (sessions / MARKER).unlink(missing_ok=True)


def read_marker(sessions: Path) -> Marker | None:
    """Return the mark; None where there is none, or none that can be read."""
    try:
        values = json.loads((sessions / MARKER).read_text(encoding="utf-8"))
        marker = Marker(**{**values, "restarts": tuple(values["restarts"])})
        times = (marker.began_ns, marker.server_ns, marker.wall_ns)
        names = (marker.session, marker.take)
        right = all(isinstance(t, int) for t in times) and all(is_safe_name(n) for n in names)
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None
    return marker if right else None

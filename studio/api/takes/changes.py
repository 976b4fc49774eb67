"""Detection of added and removed takes, also of those that another program put into the folder of the sessions."""

import os
import time
from hashlib import blake2b
from pathlib import Path

from studio.take.folder.names import is_safe_name

LOOK_S = 0.5
"""Minimum interval between looks at the folders [s]."""


class Changes:
    """Watches the folders of the sessions."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions
        self._stamp = ""
        self._looked_s = -LOOK_S

    def stamp(self) -> str:
        """Return a text that changes when takes are added, removed or renamed; new folders without a take change it
        too."""
        now_s = time.monotonic()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s, self._stamp = now_s, self._look()
        return self._stamp

    def _look(self) -> str:
        try:
            with os.scandir(self._sessions) as found:
                folders = sorted(
                    (one.name, one.stat().st_mtime_ns)
                    for one in found
                    if is_safe_name(one.name) and one.is_dir()
                )
        except OSError:
            return self._stamp  # a folder that disappears meanwhile is noticed next time
        return blake2b(repr(folders).encode(), digest_size=8).hexdigest()

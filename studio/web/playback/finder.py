"""The server's interface by which the replay finds takes."""

from typing import Any, Protocol

from studio.take.folder.take import Take


class TakeFinder(Protocol):
    """Finds takes and their solves."""

    def take(self, session: str, name: str) -> Take:
        """Return a take."""
        ...

    def solve(self, take: Take, name: str, performer: str | None = None) -> Any:
        """Return the path of the poses of a take's solve, or of one of its several performers."""
        ...

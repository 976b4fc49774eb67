"""Links to replays on disk: `sessions/shares/<id>.json` and `<id>.html`.

The file is made once: a solve that changes or goes later does not touch it. Whoever has the token sees the replay and
nothing else; a link that is taken back leads nowhere, and its file is gone.
"""

import json
import secrets
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from studio.engine.errors import StudioError, TakeError
from studio.engine.files import write_atomically, write_json
from studio.take.names import check_name, inside

FOLDER = "shares"
MAX_TITLE = 200


class NoSuchShare(StudioError):
    """A link that leads nowhere, or leads there no more."""


class Share(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A link.

    Attributes:
        id: names it in the API; token: the secret in the link.
        title: what stands over the replay; take, solve: what it shows.
        start_s, end_s: the part [s from the solve's first frame]; None: all of it.
        created: ISO 8601, UTC; size_bytes: of the file.
    """

    id: str
    token: str
    title: str
    take: str
    solve: str
    start_s: float | None
    end_s: float | None
    created: str
    size_bytes: int


class Shares:
    """All links of a folder of sessions. Files are the truth: they are read whenever they are asked for."""

    def __init__(self, sessions: Path, *, now: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self._folder = sessions / FOLDER
        self._now = now

    def add(
        self, page: bytes, *, title: str, take: str, solve: str, start_s: float | None, end_s: float | None
    ) -> Share:
        """Keep a replay page under a new link.

        Raises:
            StudioError: the disk refuses; nothing is left behind.
        """
        created = self._now()
        share = Share(
            id=f"replay_{created:%Y%m%d_%H%M%S}_{secrets.token_hex(2)}",
            token=secrets.token_urlsafe(24),
            title=title,
            take=take,
            solve=solve,
            start_s=start_s,
            end_s=end_s,
            created=created.isoformat(timespec="seconds"),
            size_bytes=len(page),
        )
        with write_atomically(self._file(share.id, ".html")) as file:
            file.write(page)
        try:
            write_json(self._file(share.id, ".json"), msgspec.to_builtins(share))
        except BaseException:
            self._file(share.id, ".html").unlink(missing_ok=True)
            raise
        return share

    def list(self) -> list[Share]:
        """Return all links, the newest first; a file that cannot be read is passed over."""
        found = []
        for path in self._folder.glob("*.json"):
            try:
                found.append(msgspec.convert(json.loads(path.read_text(encoding="utf-8")), Share))
            except (OSError, ValueError, RecursionError):  # msgspec.ValidationError is a ValueError
                continue
        return sorted(found, key=lambda share: (share.created, share.id), reverse=True)

    def get(self, share_id: str) -> Share:
        """Return a link.

        Raises:
            NoSuchShare: there is none.
        """
        for share in self.list():
            if share.id == share_id:
                return share
        raise NoSuchShare(f"there is no share {share_id[:80]!r}; GET /api/v1/shares lists them")

    def by_token(self, token: str) -> Share:
        """Return the link with this secret.

        Raises:
            NoSuchShare: there is none.
        """
        found = None
        for share in self.list():
            if secrets.compare_digest(share.token.encode(), token.encode()):
                found = share
        if found is None:
            raise NoSuchShare("this link leads to no replay; ask for a new one")
        return found

    def page(self, share: Share) -> bytes:
        """Return a link's file.

        Raises:
            NoSuchShare: it is gone.
        """
        try:
            return self._file(share.id, ".html").read_bytes()
        except OSError as error:
            raise NoSuchShare(f"the replay of this link is gone: {error.strerror}") from error

    def remove(self, share_id: str) -> Share:
        """Take a link back and delete its file; return what it was.

        Raises:
            NoSuchShare: there is none. TakeError: the disk refuses.
        """
        share = self.get(share_id)
        try:
            self._file(share.id, ".json").unlink()
            self._file(share.id, ".html").unlink(missing_ok=True)
        except OSError as error:
            raise TakeError(f"cannot delete share {share.id}: {error.strerror}") from error
        return share

    def _file(self, share_id: str, ending: str) -> Path:
        return inside(self._folder, check_name("share", share_id) + ending)

"""Links to replays on disk: `sessions/shares/<id>.json` and `<id>.html`.

The file is made once: a solve that changes or goes later does not touch it. Whoever has the token sees the replay and
nothing else; a link that is taken back leads nowhere. For a day it can be put back, then its file is deleted.
"""

import json
import secrets
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from studio.engine.errors import StudioError
from studio.engine.files import write_atomically, write_json
from studio.take.names import check_name, inside

FOLDER = "shares"
MAX_TITLE = 200
KEPT = timedelta(days=1)
"""How long what was taken back can be put back."""


class NoSuchShare(StudioError):
    """A link that leads nowhere, or leads there no more."""


class Share(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A link.

    Attributes:
        id: names it in the API; token: the secret in the link.
        title: what stands over the replay; take, solve: what it shows.
        start_s, end_s: the part [s from the solve's first frame]; None: all of it.
        created: ISO 8601, UTC; size_bytes: of the file.
        revoked: when it was taken back (ISO 8601, UTC), or empty.
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
    revoked: str = ""


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
        self._delete_old()
        created = self._now()
        share = Share(
            id=f"replay_{created:%Y%m%d_%H%M%S}_{secrets.token_hex(2)}",
            token=secrets.token_urlsafe(24),
            title=title,
            take=take,
            solve=solve,
            start_s=start_s,
            end_s=end_s,
            created=self._time(),
            size_bytes=len(page),
        )
        with write_atomically(self._file(share.id, ".html")) as file:
            file.write(page)
        try:
            self._save(share)
        except BaseException:
            self._file(share.id, ".html").unlink(missing_ok=True)
            raise
        return share

    def list(self) -> list[Share]:
        """Return all links that lead somewhere, the newest first; a file that cannot be read is passed over."""
        return [share for share in self._all() if not share.revoked]

    def same(
        self,
        *,
        title: str,
        take: str,
        solve: str,
        start_s: float | None,
        end_s: float | None,
        since: datetime,
    ) -> Share | None:
        """Return the link that was made of the same since a time, None where there is none."""
        wanted = (title, take, solve, start_s, end_s)
        for share in self.list():
            had = (share.title, share.take, share.solve, share.start_s, share.end_s)
            if had == wanted and datetime.fromisoformat(share.created) >= since:
                return share
        return None

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
        """Take a link back; return what it was.

        Raises:
            NoSuchShare: there is none. StudioError: the disk refuses.
        """
        return self._save(msgspec.structs.replace(self.get(share_id), revoked=self._time()))

    def restore(self, share_id: str) -> Share:
        """Have a link that was taken back lead to its replay again.

        Raises:
            NoSuchShare: there is none, or its file was deleted. StudioError: the disk refuses.
        """
        for share in self._all():
            if share.id == share_id and share.revoked:
                return self._save(msgspec.structs.replace(share, revoked=""))
        raise NoSuchShare(f"there is no share {share_id[:80]!r} to put back")

    def _all(self) -> "list[Share]":
        found = []
        for path in self._folder.glob("*.json"):
            try:
                found.append(msgspec.convert(json.loads(path.read_text(encoding="utf-8")), Share))
            except (OSError, ValueError, RecursionError):  # msgspec.ValidationError is a ValueError
                continue
        return sorted(found, key=lambda share: (share.created, share.id), reverse=True)

    def _delete_old(self) -> None:
        """Delete what was taken back a day ago."""
        for share in self._all():
            if share.revoked and self._now() - datetime.fromisoformat(share.revoked) > KEPT:
                for ending in (".json", ".html"):
                    self._file(share.id, ending).unlink(missing_ok=True)

    def _save(self, share: Share) -> Share:
        write_json(self._file(share.id, ".json"), msgspec.to_builtins(share))
        return share

    def _time(self) -> str:
        return self._now().isoformat(timespec="microseconds")

    def _file(self, share_id: str, ending: str) -> Path:
        return inside(self._folder, check_name("share", share_id) + ending)

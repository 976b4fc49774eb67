"""Links to replays on disk: `sessions/shares/<id>.json` and `<id>.html`.

The file is made once; later changes of the solve do not affect it. A reader with the token sees the replay and
nothing else; a revoked link is invalid. It can be restored for a day, then its file is deleted.
"""

import json
import secrets
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from studio.engine.base.errors import StudioError
from studio.engine.base.files import write_atomically, write_json
from studio.engine.base.sentences import system_says
from studio.take.folder.names import check_name, inside

FOLDER = "shares"
MAX_TITLE = 200
KEPT = timedelta(days=1)
"""Time for which a revoked link can be restored."""


class NoSuchShare(StudioError):
    """An invalid or revoked link."""


class ShareLink(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A link.

    Attributes:
        id: name in the API; token: the secret in the link.
        title: shown above the replay; take, solve: its origin.
        start_s, end_s: the part [s from the solve's first frame]; None: all of it.
        created: ISO 8601, UTC; size_bytes: of the file.
        revoked: time of revocation (ISO 8601, UTC), or empty.
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
    """All links of a folder of sessions. The files are read at every request."""

    def __init__(self, sessions: Path, *, now: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self._folder = sessions / FOLDER
        self._now = now

    def add(
        self, page: bytes, *, title: str, take: str, solve: str, start_s: float | None, end_s: float | None
    ) -> ShareLink:
        """Store a replay page under a new link.

        Raises:
            StudioError: the disk refuses; nothing is left behind.
        """
        self._delete_old()
        created = self._now()
        share = ShareLink(
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

    def list(self) -> list[ShareLink]:
        """Return all valid links, the newest first; files that cannot be read are ignored."""
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
    ) -> ShareLink | None:
        """Return an existing link to the same replay, made after a given time; None if there is none."""
        wanted = (title, take, solve, start_s, end_s)
        for share in self.list():
            had = (share.title, share.take, share.solve, share.start_s, share.end_s)
            if had == wanted and datetime.fromisoformat(share.created) >= since:
                return share
        return None

    def get(self, share_id: str) -> ShareLink:
        """Return a link.

        Raises:
            NoSuchShare: there is none.
        """
        for share in self.list():
            if share.id == share_id:
                return share
        raise NoSuchShare(
            "share.none", "there is no share {id!r}; GET /api/v1/shares lists them", id=share_id[:80]
        )

    def by_token(self, token: str) -> ShareLink:
        """Return the link with this secret.

        Raises:
            NoSuchShare: there is none.
        """
        found = None
        for share in self.list():
            if secrets.compare_digest(share.token.encode(), token.encode()):
                found = share
        if found is None:
            raise NoSuchShare("share.unknown_link", "this link leads to no replay; ask for a new one")
        return found

    def page(self, share: ShareLink) -> bytes:
        """Return a link's file.

        Raises:
            NoSuchShare: it is gone.
        """
        try:
            return self._file(share.id, ".html").read_bytes()
        except OSError as error:
            raise NoSuchShare(
                "share.gone", "the replay of this link is gone: {error}", error=system_says(error)
            ) from error

    def remove(self, share_id: str) -> ShareLink:
        """Revoke a link; return it.

        Raises:
            NoSuchShare: there is none.
            StudioError: the disk refuses.
        """
        return self._save(msgspec.structs.replace(self.get(share_id), revoked=self._time()))

    def restore(self, share_id: str) -> ShareLink:
        """Restore a revoked link.

        Raises:
            NoSuchShare: there is none, or its file was deleted.
            StudioError: the disk refuses.
        """
        for share in self._all():
            if share.id == share_id and share.revoked:
                return self._save(msgspec.structs.replace(share, revoked=""))
        raise NoSuchShare(
            "share.not_restorable", "there is no share {share!r} to put back", share=share_id[:80]
        )

    def _all(self) -> "list[ShareLink]":
        found = []
        for path in self._folder.glob("*.json"):
            try:
                found.append(msgspec.convert(json.loads(path.read_text(encoding="utf-8")), ShareLink))
            except (OSError, ValueError, RecursionError):  # msgspec.ValidationError is a ValueError
                continue
        return sorted(found, key=lambda share: (share.created, share.id), reverse=True)

    def _delete_old(self) -> None:
        """Delete links that were revoked a day ago."""
        for share in self._all():
            if share.revoked and self._now() - datetime.fromisoformat(share.revoked) > KEPT:
                for ending in (".json", ".html"):
                    self._file(share.id, ending).unlink(missing_ok=True)

    def _save(self, share: ShareLink) -> ShareLink:
        write_json(self._file(share.id, ".json"), msgspec.to_builtins(share))
        return share

    def _time(self) -> str:
        return self._now().isoformat(timespec="microseconds")

    def _file(self, share_id: str, ending: str) -> Path:
        return inside(self._folder, check_name("share", share_id) + ending)

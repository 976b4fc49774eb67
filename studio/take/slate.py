"""What people write about a take: its name and session, performer, notes, rating, star."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studio.engine.errors import TakeError
from studio.take.lock import is_held
from studio.take.names import check_name
from studio.take.sessions import take_path
from studio.take.take import Take, check_free

RATINGS = range(6)
_MAX_NOTES, _MAX_PERFORMER = 10_000, 200


@dataclass(frozen=True)
class Slate:
    """Changes to a take; None leaves what is there.

    Attributes:
        session, name: new names; the folder is moved.
        performer, notes: free text.
        rating: 0 (none) to 5.
        starred: a favourite.
    """

    session: str | None = None
    name: str | None = None
    performer: str | None = None
    notes: str | None = None
    rating: int | None = None
    starred: bool | None = None


def change_slate(sessions_dir: Path, session: str, name: str, slate: Slate) -> Take:
    """Change what is written about a take, and where it lies; return it.

    Raises:
        TakeError: no such take, a name that is taken or not allowed, a take in use, or a value out of range.
    """
    _check(slate)
    take = Take.open(take_path(sessions_dir, session, name))
    to = take_path(sessions_dir, slate.session or session, slate.name or name)
    if to != take.path:
        if is_held(take.path):
            raise TakeError(f"take {session}/{name} is in use; wait until that is done")
        check_free(to)
        _move(take, to)
    changes: dict[str, Any] = {
        "session": to.parent.name, "name": to.name, "id": f"{to.parent.name}/{to.name}",
        "performer": slate.performer, "notes": slate.notes,
        "rating": None if slate.rating is None else slate.rating or None, "starred": slate.starred,
    }  # fmt: skip
    if slate.rating == 0:
        take.meta["rating"] = None
    take.meta.update({key: value for key, value in changes.items() if value is not None})
    take.save_meta()
    return take


def _check(slate: Slate) -> None:
    for kind, value in (("session", slate.session), ("take", slate.name)):
        if value is not None:
            check_name(kind, value)
    if slate.rating is not None and slate.rating not in RATINGS:
        raise TakeError(f"rating {slate.rating} is not allowed; allowed: 0 (none) to {RATINGS[-1]}")
    for text, longest, what in (
        (slate.notes, _MAX_NOTES, "notes"),
        (slate.performer, _MAX_PERFORMER, "performer"),
    ):
        if text is not None and len(text) > longest:
            raise TakeError(f"{what} of {len(text)} characters; at most {longest} are allowed")


def _move(take: Take, to: Path) -> None:
    try:
        to.parent.mkdir(parents=True, exist_ok=True)
        if to.is_dir():
            to.rmdir()  # check_free saw that it is empty
        take.path.rename(to)
    except OSError as error:
        raise TakeError(f"cannot move the take to {to.parent.name}/{to.name}: {error.strerror}") from error
    take.path = to

"""The slate of a take: its name and session, performer, notes, tags, rating, star, markers."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studio.engine.base.errors import TakeError
from studio.engine.base.sentences import system_says
from studio.engine.model.performers.exchange import Exchange
from studio.take.folder.lock import is_held
from studio.take.folder.meta import MarkerMeta
from studio.take.folder.names import check_name
from studio.take.folder.performers import checked_exchanges, checked_names
from studio.take.folder.take import Take, check_free
from studio.take.library.sessions import take_path

RATINGS = range(6)
_MAX_MARKER, _MAX_MARKERS = 60, 500
_NOT_IN_TAGS = ',"'
_MAX_NOTES, _MAX_PERFORMER, _MAX_TAG, _MAX_TAGS = 10_000, 200, 40, 30


@dataclass(frozen=True)
class TimelineMarker:
    """A named instant of a take, stage time [s]."""

    time_s: float
    name: str


@dataclass(frozen=True)
class Slate:
    """Changes to a take; None changes nothing.

    Attributes:
        session, name: new names; the folder is moved.
        performer, notes: free text.
        tags: short words by which takes are found; duplicates, regardless of case, are kept once.
        markers: all of them, in any order.
        rating: 0 (none) to 5.
        starred: a favourite.
        performer_names: of all performers, by `performer_1`, ...; those left out lose theirs.
        exchanges: of performers, all of them, in the order in which they were made.
    """

    session: str | None = None
    name: str | None = None
    performer: str | None = None
    notes: str | None = None
    tags: tuple[str, ...] | None = None
    markers: tuple[TimelineMarker, ...] | None = None
    rating: int | None = None
    starred: bool | None = None
    performer_names: Mapping[str, str] | None = None
    exchanges: tuple[Exchange, ...] | None = None


def change_slate(sessions_dir: Path, session: str, name: str, slate: Slate) -> Take:
    """Change a take's slate and place; return the take.

    Raises:
        TakeError: no such take, a name that is taken or not allowed, a take in use, or a value out of range.
    """
    _check(slate)
    take = Take.open(take_path(sessions_dir, session, name))
    to = take_path(sessions_dir, slate.session or session, slate.name or name)
    if to != take.path:
        if is_held(take.path):
            raise TakeError(
                "take.in_use", "take {take} is in use; wait until that is done", take=f"{session}/{name}"
            )
        check_free(to)
        _move(take, to)
    changes: dict[str, Any] = {
        "session": to.parent.name, "name": to.name, "id": f"{to.parent.name}/{to.name}",
        "performer": slate.performer, "notes": slate.notes,
        "tags": None if slate.tags is None else _distinct(slate.tags),
        "markers": None if slate.markers is None else _in_order(slate.markers),
        "performer_names": None if slate.performer_names is None else checked_names(slate.performer_names),
        "exchanges": None if slate.exchanges is None else checked_exchanges(slate.exchanges),
        "rating": None if slate.rating is None else slate.rating or None, "starred": slate.starred,
    }  # fmt: skip
    if slate.rating == 0:
        take.meta["rating"] = None
    given: Any = {key: value for key, value in changes.items() if value is not None}
    take.meta.update(given)
    take.save_meta()
    return take


def _check(slate: Slate) -> None:
    for kind, value in (("session", slate.session), ("take", slate.name)):
        if value is not None:
            check_name(kind, value)
    if slate.rating is not None and slate.rating not in RATINGS:
        raise TakeError(
            "slate.rating",
            "rating {rating} is not allowed; allowed: 0 (none) to {most}",
            rating=slate.rating,
            most=RATINGS[-1],
        )
    for tag in slate.tags or ():
        if len(tag) > _MAX_TAG or any(sign in tag for sign in _NOT_IN_TAGS) or not tag.isprintable():
            raise TakeError(
                "slate.tag",
                "tag {tag!r} is not allowed; allowed: up to {most} characters without commas and quotes",
                tag=tag[:60],
                most=_MAX_TAG,
            )
    if len(slate.tags or ()) > _MAX_TAGS:
        raise TakeError(
            "slate.tags",
            "a take with {n} tags; at most {most} are allowed",
            n=len(slate.tags or ()),
            most=_MAX_TAGS,
        )
    for marker in slate.markers or ():
        if not marker.name.strip() or len(marker.name) > _MAX_MARKER or not math.isfinite(marker.time_s):
            raise TakeError(
                "slate.marker",
                "marker {name!r} is not allowed; allowed: a name of up to {most} characters, at a time",
                name=marker.name[:80],
                most=_MAX_MARKER,
            )
    if len(slate.markers or ()) > _MAX_MARKERS:
        raise TakeError(
            "slate.markers",
            "a take with {n} markers; at most {most} are allowed",
            n=len(slate.markers or ()),
            most=_MAX_MARKERS,
        )
    for text, longest, what in (
        (slate.notes, _MAX_NOTES, "notes"),
        (slate.performer, _MAX_PERFORMER, "performer"),
    ):
        if text is not None and len(text) > longest:
            raise TakeError(
                "slate.text",
                "{what} of {n} characters; at most {most} are allowed",
                what=what,
                n=len(text),
                most=longest,
            )


def _in_order(markers: Sequence[TimelineMarker]) -> list[MarkerMeta]:
    found: list[MarkerMeta] = [{"time_s": marker.time_s, "name": marker.name.strip()} for marker in markers]
    return sorted(found, key=lambda marker: (marker["time_s"], marker["name"]))


def _distinct(tags: Sequence[str]) -> list[str]:
    """Return tags in order, without blanks around them, each once."""
    kept: dict[str, str] = {}
    for tag in (" ".join(tag.split()) for tag in tags):
        if tag:
            kept.setdefault(tag.casefold(), tag)
    return list(kept.values())


def _move(take: Take, to: Path) -> None:
    try:
        to.parent.mkdir(parents=True, exist_ok=True)
        if to.is_dir():
            to.rmdir()  # `check_free` found it empty
        take.path.rename(to)
    except OSError as error:
        raise TakeError(
            "slate.not_moved",
            "cannot move the take to {place}: {error}",
            place=f"{to.parent.name}/{to.name}",
            error=system_says(error),
        ) from error
    take.path = to

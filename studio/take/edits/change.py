"""Changes of a take's edits: one or several at once, undo and redo, by several programs and pages."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import msgspec

from studio.engine.base.errors import TakeError
from studio.engine.edits.edit import Edit
from studio.take.edits.carry import carried
from studio.take.edits.check import check_edits
from studio.take.edits.kept import EditStep, TakeEdits, read_edits, write_edits
from studio.take.folder.lock import hold, release
from studio.take.folder.take import Take

MOST_EDITS = 2000
MOST_UNDONE = 100
"""Maximum number of changes that can be undone."""

_WAIT_S = 5.0


class StaleEditsError(TakeError):
    """A change that was made on a list of edits that is not the present one."""


def change_edits(
    take: Take, put: Sequence[Edit] = (), remove: Sequence[str] = (), *, revision: int | None = None
) -> TakeEdits:
    """Add edits to a take's list, or replace those with the same ids, and remove others; return the list.

    All of it is one change, undone in one step.

    Args:
        take: whose edits.
        put: an empty id gets a new one.
        remove: ids.
        revision: that of the list on which the change was made; None = any. An edit that another
            program has changed or removed since is not overwritten.

    Raises:
        StaleEditsError: an edit has changed since `revision`.
        TakeError: an edit that is not allowed for this take, no edit with such an id, too many, or another
            program holds the take.
        FormatError: see `read_edits`.
    """

    def change(kept: TakeEdits) -> TakeEdits:
        _check_not_stale(kept, [one.id for one in put if one.id] + [*remove], revision)
        steps = _steps(kept, put, remove)
        check_edits(take, [step.after for step in steps if step.after is not None], kept.edits)
        if not steps:
            return kept
        made = _made(kept, steps)
        if len(made.edits) > MOST_EDITS:
            raise TakeError(
                "edits.too_many", "{n} edits; at most {most} are allowed", n=len(made.edits), most=MOST_EDITS
            )
        return msgspec.structs.replace(made, undo=(*kept.undo, steps)[-MOST_UNDONE:], redo=())

    return _changed(take, change)


def undo_edits(take: Take, *, revision: int | None = None) -> TakeEdits:
    """Undo the last change of a take's edits; return the list.

    Raises:
        StaleEditsError: the list has changed since `revision`.
        TakeError: there is no change to undo, or another program holds the take.
        FormatError: see `read_edits`.
    """

    return _gone_over(take, revision, back=True)


def redo_edits(take: Take, *, revision: int | None = None) -> TakeEdits:
    """Redo the change that was undone last; return the list.

    Raises:
        StaleEditsError: the list has changed since `revision`.
        TakeError: there is no change to redo, or another program holds the take.
        FormatError: see `read_edits`.
    """

    return _gone_over(take, revision, back=False)


def _gone_over(take: Take, revision: int | None, *, back: bool) -> TakeEdits:
    """Undo the last change, or redo the one that was undone last."""

    def change(kept: TakeEdits) -> TakeEdits:
        _check_same(kept, revision)
        undo, redo = [*kept.undo], [*kept.redo]
        if not (undo if back else redo):
            raise _nothing_to(back=back)
        steps = (undo if back else redo).pop()
        (redo if back else undo).append(steps)
        if back:
            steps = tuple(EditStep(one.place, one.after, one.before) for one in reversed(steps))
        return msgspec.structs.replace(_made(kept, steps), undo=tuple(undo), redo=tuple(redo))

    return _changed(take, change)


def _nothing_to(*, back: bool) -> TakeError:
    if back:
        return TakeError("edits.nothing_to_undo", "there is no change of edits to take back")
    return TakeError("edits.nothing_to_redo", "there is no change of edits to make again")


def _changed(take: Take, change: Callable[[TakeEdits], TakeEdits]) -> TakeEdits:
    """Read, change and write a take's edits, while nobody else does."""
    with _held(take):
        before = read_edits(take)
        kept, _ = carried(take, before)
        made = change(kept)
        if made is not before:
            write_edits(take, made)
        return made


@contextmanager
def _held(take: Take) -> Iterator[None]:
    """Hold the take during the block; first wait until no other program holds it."""
    until_s = time.monotonic() + _WAIT_S
    while (handle := hold(take.path)) is None:
        if time.monotonic() > until_s:
            raise TakeError("take.in_use", "take {take} is in use; wait until that is done", take=take.path)
        time.sleep(0.01)
    try:
        yield
    finally:
        release(handle)


def _steps(kept: TakeEdits, put: Sequence[Edit], remove: Sequence[str]) -> tuple[EditStep, ...]:
    """Return the steps of a change; an edit that stays the same makes none.

    Raises:
        TakeError: no edit with such an id.
    """
    edits, steps = [*kept.edits], []
    for id_ in dict.fromkeys(remove):
        place = _place(edits, id_)
        if place is None:
            raise no_such_edit(id_, edits)
        steps.append(EditStep(place, edits.pop(place), None))
    taken = {one.id for one in (*edits, *put)}
    for one in put:
        new = one if one.id else msgspec.structs.replace(one, id=_new_id(kept.revision + 1, taken))
        taken.add(new.id)
        place = _place(edits, new.id)
        if place is None:
            steps.append(EditStep(len(edits), None, new))
            edits.append(new)
        elif edits[place] != new:
            steps.append(EditStep(place, edits[place], new))
            edits[place] = new
    return tuple(steps)


def _new_id(revision: int, taken: set[str]) -> str:
    return next(name for k in range(len(taken) + 1) if (name := f"e{revision + k}") not in taken)


def _place(edits: Sequence[Edit], id_: str) -> int | None:
    return next((k for k, one in enumerate(edits) if one.id == id_), None)


def _made(kept: TakeEdits, steps: Sequence[EditStep]) -> TakeEdits:
    """Return the list with the steps applied in order."""
    edits, changed_in, revision = [*kept.edits], dict(kept.changed_in), kept.revision + 1
    for step in steps:
        if step.before is not None:
            place = _place(edits, step.before.id)
            if place is not None:
                edits.pop(place)
            changed_in.pop(step.before.id, None)
        if step.after is not None:
            edits.insert(step.place, step.after)
            changed_in[step.after.id] = revision
    return msgspec.structs.replace(kept, revision=revision, edits=tuple(edits), changed_in=changed_in)


def _check_same(kept: TakeEdits, revision: int | None) -> None:
    if revision is not None and revision != kept.revision:
        raise StaleEditsError(
            "edits.stale",
            "the edits are those of revision {now}, not {revision}: somebody else has changed them; look at them, "
            "and try again",
            now=kept.revision,
            revision=revision,
        )


def _check_not_stale(kept: TakeEdits, ids: Sequence[str], revision: int | None) -> None:
    for id_ in ids:
        if revision is not None and kept.changed_in.get(id_, 0) > revision:
            raise StaleEditsError(
                "edits.stale_edit",
                "edit {id} was changed since revision {revision}; look at it, and try again",
                id=id_,
                revision=revision,
            )


def no_such_edit(id_: str, edits: Sequence[Edit]) -> TakeError:
    """Return the error for an id that no edit has."""
    return TakeError(
        "edits.none",
        "there is no edit {id!r}; there are: {ids}",
        id=id_[:80],
        ids=[one.id for one in edits] or "none",
    )

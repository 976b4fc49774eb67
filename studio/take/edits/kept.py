"""`edits.json` of a take: its edits, and what undo and redo need."""

import json
from pathlib import Path
from typing import Any

import msgspec

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.files import write_json
from studio.engine.base.sentences import system_says
from studio.engine.base.versions import EDITS
from studio.engine.edits.edit import Edit
from studio.take.folder.take import Take

EDITS_FILE = "edits.json"


class EditStep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One edit that was put in, changed or removed.

    Attributes:
        place: its present or former place in the list, from 0.
        before: None = it was put in.
        after: None = it was removed.
    """

    place: int
    before: Edit | None
    after: Edit | None


class TakeEdits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The content of `edits.json`.

    Attributes:
        revision: rises by one with every change, undo and redo.
        calibration: number of the calibration under which the places and directions hold; None = none was in use.
        edits: in the order in which they were made.
        changed_in: revision in which each edit was last changed, by its id.
        undo: changes that can be undone, the last one last; each is one or several steps.
        redo: changes that were undone, the next one last.
    """

    revision: int = 0
    calibration: int | None = None
    edits: tuple[Edit, ...] = ()
    changed_in: dict[str, int] = {}
    undo: tuple[tuple[EditStep, ...], ...] = ()
    redo: tuple[tuple[EditStep, ...], ...] = ()

    def by_id(self) -> dict[str, Edit]:
        """Return the edits by their ids."""
        return {one.id: one for one in self.edits}


def read_edits(take: Take) -> TakeEdits:
    """Return the content of a take's `edits.json`; no edits if there is no such file.

    Raises:
        FormatError: it is damaged, or a newer program wrote it.
    """
    file = take.path / EDITS_FILE
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return TakeEdits(calibration=take.meta["calibration"])
    except OSError as error:
        raise FormatError(
            "edits.unreadable", "{file} cannot be read: {error}", file=file, error=system_says(error)
        ) from error
    except (ValueError, RecursionError) as error:
        raise _damaged(file, error) from error
    if not isinstance(value, dict):
        raise _damaged(file, "it is no object")
    try:
        return msgspec.convert(EDITS.current(value, file), TakeEdits)
    except msgspec.ValidationError as error:
        raise _damaged(file, error) from error


def write_edits(take: Take, edits: TakeEdits) -> None:
    """Write a take's `edits.json`, atomically.

    Raises:
        StudioError: see `files.write_atomically`.
    """
    write_json(take.path / EDITS_FILE, EDITS.stamped(msgspec.to_builtins(edits)))


def edit_from_json(value: Any, *, texts: bool = False) -> Edit:
    """Return the edit of a JSON value, as `edits.json` has it; numbers may be `texts`.

    Raises:
        TakeError: an unknown kind or key, or a value of another type.
    """
    try:
        return msgspec.convert(value, Edit, strict=not texts)
    except msgspec.ValidationError as error:
        raise TakeError(
            "edits.not_an_edit",
            "this is no edit: {error}; docs/edits.md lists the kinds and their fields",
            error=str(error),
        ) from error


def _damaged(file: Path, error: object) -> FormatError:
    return FormatError(
        "edits.damaged",
        "{file} is damaged ({error}); put it right, or remove it: the take has no edits then",
        file=file,
        error=str(error),
    )

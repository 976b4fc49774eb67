"""Reference motions stored with a take: `references/<name>`, their alignment, and removed ones.

`references/<name>.json` holds the options of the alignment. `solves/<solve>/references/<name>.npz` is the reference
in that solve's stage frame; it is derived, and deleted with the solve. A removed reference stays in
`references/.removed/` until it is restored, or another of its name is removed.
"""

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.files import write_json
from studio.engine.base.sentences import system_says
from studio.engine.metrics.reference.kinds import REFERENCE_KINDS
from studio.take.folder.measured import forget_measured
from studio.take.folder.names import check_name, inside
from studio.take.folder.performers import performer_by_name
from studio.take.folder.take import PERFORMER, Take

FOLDER = "references"
_REMOVED = ".removed"
_MAX_OFFERED = 500


@dataclass(frozen=True)
class HowAligned:
    """Options of a reference's alignment.

    Attributes:
        align_time: it has its own clock, whose offset and drift are estimated.
        align: `rigid`, or `similarity` (the size too).
        unit_m: metres per unit of a BVH; None = by a height of 1.75 m.
        performer: the one of several whose motion it is; None = the first one.
    """

    align_time: bool = False
    align: str = "rigid"
    unit_m: float | None = None
    performer: str | None = None


def reference_names(take: Take) -> list[str]:
    """Return the names of a take's references, in alphabetical order."""
    return sorted(path.name for path in (take.path / FOLDER).glob("*") if _is_reference(path))


def reference_path(take: Take, name: str) -> Path:
    """Return the path of a reference, which need not exist.

    Raises:
        TakeError: a name that is not allowed.
        FormatError: an unknown kind.
    """
    check_name("reference", name)
    if Path(name).suffix.lower() not in REFERENCE_KINDS:
        raise FormatError(
            "reference.unread_kind",
            "reference {name!r} is of no kind that is read; allowed: {kinds}",
            name=name,
            kinds=[*REFERENCE_KINDS],
        )
    return inside(take.path / FOLDER, name)


def how_aligned(take: Take, name: str) -> HowAligned:
    """Return the options of a reference's alignment; the defaults if none are stored, or the file is damaged."""
    try:
        value = json.loads(_how_path(take, name).read_text(encoding="utf-8"))
        how = HowAligned(
            bool(value["align_time"]), str(value["align"]), value["unit_m"], value.get("performer")
        )
    except (OSError, ValueError, KeyError, TypeError):
        return HowAligned()
    return how if how.align in ("rigid", "similarity") else HowAligned()


def keep_how_aligned(take: Take, name: str, how: HowAligned) -> None:
    """Store the options of a reference's alignment."""
    write_json(_how_path(take, name), asdict(how))


def placed_path(take: Take, name: str, solve: str, how: HowAligned | None = None) -> Path:
    """Return the path of a reference in a solve's stage frame, next to the poses of the performer whose motion it is.

    `how` selects the performer; if None, the stored options do.

    Raises:
        TakeError: the solve has no such performer.
    """
    reference_path(take, name)
    how = how_aligned(take, name) if how is None else how
    return inside(take.performer_folder(solve, how.performer), FOLDER, f"{name}.npz")


def has_performer(take: Take, name: str, solve: str) -> bool:
    """Whether a solve has the performer whose motion a reference is."""
    wanted = how_aligned(take, name).performer
    names = take.performer_names(solve) or [PERFORMER]
    return wanted is None or performer_by_name(take.meta, wanted) in names


def forget_placed(take: Take, name: str) -> None:
    """Delete the derived files of a reference, because the file or its alignment has changed."""
    for solve in take.solve_names():
        for performer in take.performer_names(solve) or [None]:
            folder = take.performer_folder(solve, performer)
            placed = inside(folder, FOLDER, f"{name}.npz")
            placed.unlink(missing_ok=True)
            placed.with_suffix(".json").unlink(missing_ok=True)
            forget_measured(folder, name)


def remove_reference(take: Take, name: str) -> None:
    """Remove a reference; `restore_reference` can restore it.

    Raises:
        TakeError: there is none of that name, or the folder cannot be written.
    """
    path = reference_path(take, name)
    if not path.is_file():
        raise TakeError(
            "reference.none_of_take", "take {take} has no reference {name!r}", take=take.meta["id"], name=name
        )
    _move(take, name, path.parent, path.parent / _REMOVED)
    forget_placed(take, name)


def restore_reference(take: Take, name: str) -> None:
    """Restore a removed reference.

    Raises:
        TakeError: none was removed, another has its name, or the folder cannot be written.
    """
    path = reference_path(take, name)
    if path.exists():
        raise TakeError(
            "reference.another",
            "take {take} has another reference {name!r} by now; remove it first",
            take=take.meta["id"],
            name=name,
        )
    if not (path.parent / _REMOVED / name).is_file():
        raise TakeError(
            "reference.not_removed",
            "no reference {name!r} of take {take} was removed",
            name=name,
            take=take.meta["id"],
        )
    _move(take, name, path.parent / _REMOVED, path.parent)


def offered_files(sessions: Path) -> list[str]:
    """Return possible references in the sessions' folder, by their path in it: files next to takes, such as
    `<take>.truth.csv`, and files in the folder itself; at most 500.
    """
    found = []
    for pattern in ("*", "*/*"):
        for path in sorted(sessions.glob(pattern)):
            relative = path.relative_to(sessions)
            hidden = any(part.startswith(".") for part in relative.parts)
            if not hidden and _is_reference(path) and _leads_inside(sessions, path):
                found.append(relative.as_posix())
    return found[:_MAX_OFFERED]


def offered_file(sessions: Path, name: str) -> Path:
    """Return one of `offered_files`.

    Raises:
        TakeError: it is none of them.
    """
    if name not in offered_files(sessions):
        raise TakeError(
            "reference.not_offered",
            "{name!r} is none of the files beside the takes; choose one that is offered",
            name=name[:120],
        )
    return sessions / name


def _is_reference(path: Path) -> bool:
    return path.suffix.lower() in REFERENCE_KINDS and not path.name.startswith(".") and path.is_file()


def _leads_inside(folder: Path, path: Path) -> bool:
    return path.resolve().is_relative_to(folder.resolve())


def _how_path(take: Take, name: str) -> Path:
    path = reference_path(take, name)
    return path.with_name(f"{path.name}.json")


def _move(take: Take, name: str, source: Path, target: Path) -> None:
    """Move a reference and its options."""
    try:
        target.mkdir(exist_ok=True)
        os.replace(source / name, target / name)
        how = source / f"{name}.json"
        if how.is_file():
            os.replace(how, target / how.name)
    except OSError as error:
        raise TakeError(
            "reference.not_moved",
            "cannot move reference {name!r} of {take}: {error}",
            name=name,
            take=take.path,
            error=system_says(error),
        ) from error

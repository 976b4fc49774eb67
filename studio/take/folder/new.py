"""Atomic creation of a take, for imports and simulations: it appears whole, or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from studio.engine.base.errors import TakeError
from studio.engine.base.sentences import system_says
from studio.take.folder.lock import hold, release
from studio.take.folder.names import is_safe_name
from studio.take.folder.take import Take, check_free

PARTIAL_MARK = ".partial-"
"""Part of the name of a take's temporary folder, `.<take>.partial-<letters>`; `doctor` looks for it."""


@contextmanager
def new_take(
    path: str | Path,
    *,
    source: str,
    session: str | None = None,
    name: str | None = None,
    calibration_s: float | None = None,
    performer: str = "",
    notes: str = "",
    created: str | None = None,
) -> Iterator[Take]:
    """Yield a take in a temporary folder next to `path`, moved to `path` when the block ends without error.

    After the block the take's `path` is the final one and its recording state `done`. An error or an
    interruption leaves nothing, not even new parent folders.

    Args:
        path: a folder that does not exist or is empty.
        source, calibration_s, performer, notes, created: as `Take.create`.
        session, name: labels; by default the names of the parent folder and of the folder itself.

    Raises:
        TakeError: `path` is not empty, or cannot be written.
    """
    final = Path(path).resolve()
    check_free(final)
    if session is None:
        session = final.parent.name if is_safe_name(final.parent.name) else "takes"
    made = _make_parents(final.parent)
    temporary: Path | None = None
    in_use: int | None = None
    try:
        try:
            temporary = Path(tempfile.mkdtemp(prefix=f".{final.name}{PARTIAL_MARK}", dir=final.parent))
            os.chmod(temporary, 0o755)
            in_use = hold(temporary)
        except OSError as error:
            raise TakeError(
                "take.not_made_choose",
                "cannot make a take at {path}: {error}; choose another",
                path=path,
                error=system_says(error),
            ) from error
        take = Take.create(
            temporary,
            session=session,
            name=final.name if name is None else name,
            source=source,
            calibration_s=calibration_s,
            performer=performer,
            notes=notes,
            created=created,
        )
        yield take
        take.meta["recording"] = "done"
        take.save_meta()
        _move(temporary, final)
        take.path, temporary = final, None
        made = []
    finally:
        release(in_use)
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
        for folder in reversed(made):
            _remove_if_empty(folder)


def _make_parents(folder: Path) -> list[Path]:
    """Make a folder and its parents; return the new ones, outermost first."""
    missing = [f for f in [folder, *folder.parents] if not f.exists()][::-1]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TakeError(
            "file.no_folder",
            "cannot make folder {path}: {error}; choose another",
            path=folder,
            error=system_says(error),
        ) from error
    return missing


def _remove_if_empty(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def _move(temporary: Path, final: Path) -> None:
    try:
        if final.is_dir():
            final.rmdir()  # fails, as it should, if the folder was filled meanwhile
        temporary.rename(final)
    except OSError as error:
        raise TakeError(
            "take.not_finished",
            "cannot finish the take at {path}: {error}; choose another",
            path=final,
            error=system_says(error),
        ) from error

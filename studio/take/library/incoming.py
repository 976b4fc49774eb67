"""Incoming files: they wait in their own folder inside the sessions until they are imported."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.file_sentences import unwritable
from studio.engine.base.sentences import system_says
from studio.take.folder.lock import hold, is_held, release
from studio.take.folder.names import free_name, inside, safe_name
from studio.take.folder.take import Take
from studio.take.importers import are_videos, import_recording
from studio.take.library.bundle import ENDING, KEPT_FREE_BYTES, read_bundle, write_bundle
from studio.take.library.sessions import take_path

PREFIX = ".import-"
MAX_BYTES = 200 * 1024**3
_COPIES = 2
"""Copies of incoming data that are on the disk for a while: the files as received, and the take."""

_LOOK_BYTES = 64 << 20
"""Amount written between two checks of the disk."""


class Incoming:
    """Files that are written one after the other, as their bytes arrive."""

    def __init__(self, sessions: Path, files: Sequence[tuple[str, int]]) -> None:
        """Make the folder for files, each with its path (of plain names, `/` between) and its size [bytes].

        Raises:
            FormatError: more than `MAX_BYTES`. StudioError: the disk has no room, or cannot be written.
        """
        self.total = sum(size for _, size in files)
        self.received = 0
        self._left = list(files)
        self._looked = 0
        self._file: IO[bytes] | None = None
        self._missing = 0
        check_room(sessions, self.total)
        try:
            sessions.mkdir(parents=True, exist_ok=True)
            self.folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=sessions))
        except OSError as error:
            raise StudioError(unwritable(sessions, error)) from error
        self._mark = hold(self.folder)

    def write(self, data: bytes) -> None:
        """Write the next bytes.

        Raises:
            FormatError: more than was announced. StudioError: the disk is full.
        """
        view = memoryview(data)
        self.received += len(view)
        if self.received > self.total:
            raise FormatError(
                "import.more_than_announced",
                "more came than the {total} bytes that were announced; send the files again",
                total=self.total,
            )
        if self.received - self._looked > _LOOK_BYTES:
            self._looked = self.received
            _check_free(self.folder, 0)
        with _told():
            while view:
                self._next()
                assert self._file is not None
                part, view = view[: self._missing], view[self._missing :]
                self._file.write(part)
                self._missing -= len(part)

    def end(self) -> None:
        """Mark the end of the data.

        Raises:
            FormatError: less than was announced. StudioError: the disk is full.
        """
        with _told():
            self._next()
        if self.received < self.total:
            raise FormatError(
                "import.broke_off",
                "only {received} of {total} bytes came: the upload broke off; send the files again",
                received=self.received,
                total=self.total,
            )

    def discard(self) -> None:
        """Delete all files."""
        if self._file is not None:
            with suppress(OSError):
                self._file.close()
            self._file = None
        release(self._mark)
        self._mark = None
        shutil.rmtree(self.folder, ignore_errors=True)

    def _next(self) -> None:
        """Continue with the next file once this one has all its bytes."""
        while self._missing == 0:
            if self._file is not None:
                self._file.close()
                self._file = None
            if not self._left:
                return
            name, self._missing = self._left.pop(0)
            path = inside(self.folder, *name.split("/"))
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")


@contextmanager
def _told() -> Iterator[None]:
    """Turn errors of the disk into a StudioError."""
    try:
        yield
    except OSError as error:
        raise StudioError(
            "import.unwritable",
            "cannot write the files that came: {error}; free some space",
            error=system_says(error),
        ) from error


def check_room(sessions: Path, size: int) -> None:
    """Raise if this many bytes may not be received.

    Raises:
        FormatError: more than `MAX_BYTES`. StudioError: the disk has no room for them and the take made of them.
    """
    if size > MAX_BYTES:
        raise FormatError(
            "import.too_large",
            "the files have {size} GB; allowed: {most} GB at most",
            size=size >> 30,
            most=MAX_BYTES >> 30,
        )
    _check_free(next(f for f in (sessions, *sessions.absolute().parents) if f.is_dir()), _COPIES * size)


def _check_free(folder: Path, needed: int) -> None:
    free = shutil.disk_usage(folder).free
    if needed > free - KEPT_FREE_BYTES:
        raise StudioError(
            "import.no_space",
            "the import needs {needed} MB and the disk has {free} MB left, of which {kept} MB "
            "are kept for recordings; free some space",
            needed=needed >> 20,
            free=free >> 20,
            kept=KEPT_FREE_BYTES >> 20,
        )


def clear_left(sessions: Path) -> None:
    """Remove incoming files that a killed server left."""
    for folder in sessions.glob(f"{PREFIX}*"):
        if not is_held(folder):
            shutil.rmtree(folder, ignore_errors=True)


def free_path(sessions: Path, session: str, label: str) -> Path:
    """Return the folder of a new take that is named after files, numbered if that name is taken."""
    stem = label[: -len(ENDING)] if label.lower().endswith(ENDING) else Path(label).stem
    name = free_name(safe_name(stem, "imported"), lambda one: take_path(sessions, session, one).exists())
    return take_path(sessions, session, name)


def import_incoming(
    folder: Path,
    root: str,
    label: str,
    out: Path,
    sync: str | None = None,
    clap_at_s: Mapping[str, float] | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Make the take at `out` from the received files at `root` in `folder`.

    Args:
        folder: of the received files.
        root: path in it.
        label: its name for people.
        out: folder of the new take.
        sync, clap_at_s: bring videos to one clock, see `find_sync`; only used for videos.
        progress: receives the share done.

    Raises:
        StudioError: the importers' error, with the names as they were given.
    """
    path = inside(folder, *root.split("/")) if root else folder
    with given_names(folder, label):
        if path.is_file() and path.name.lower().endswith(ENDING):
            read_bundle(path, out)
        elif (path / "take.json").is_file():
            bundle = folder / ENDING
            write_bundle(Take.open(path), bundle)
            read_bundle(bundle, out)
        else:
            videos = are_videos(path)
            import_recording(
                path,
                out,
                sync=sync if videos else None,
                clap_at_s=clap_at_s if videos else None,
                progress=progress,
            )


@contextmanager
def given_names(folder: Path, label: str) -> Iterator[None]:
    """Make errors name files in a folder as they were given, and the folder itself by its label."""
    try:
        yield
    except StudioError as error:
        text = error.sentence.replace(f"{folder}{os.sep}", "").replace(str(folder), label)
        raise type(error)(text) from error

"""Atomic writes: a crash leaves the old file or the new one, never a part. And stamps of files and of code."""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import IO, Any

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import system_says

FileStamp = tuple[int, int, int] | None
"""Number, size [bytes] and time of change [ns] of a file or folder; None where there is none."""


@contextmanager
def write_atomically(path: str | os.PathLike[str], *, to_disk: bool = True) -> Iterator[IO[bytes]]:
    """Yield a binary file that replaces `path` when the block ends without an error.

    Args:
        path: of the file.
        to_disk: flush the file to the disk before it replaces `path`; False leaves that to `sync_files`.

    Raises:
        StudioError: the folder cannot be written, or the disk is full. No temporary file is left.
    """
    path = Path(path)
    temporary: str | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            if to_disk:
                os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise StudioError(
            "file.unwritable_place",
            "cannot write {path}: {error}; free some space or choose another place",
            path=path,
            error=system_says(error),
        ) from error
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def file_stamp(path: Path) -> FileStamp:
    """Return a stamp that changes whenever a file or folder does; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


def sync_files(folder: Path) -> None:
    """Flush the files in a folder, at any depth, to the disk.

    Flushing all at the end is faster than flushing each as it is written, because the first flush also writes most of
    the others.
    """
    for path in (path for path in folder.rglob("*") if path.is_file()):
        with path.open("rb+") as file:
            os.fsync(file.fileno())


def write_json(path: str | os.PathLike[str], value: Any, *, to_disk: bool = True) -> None:
    """Write `value` as indented JSON, atomically. A number that is not finite raises ValueError."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    with write_atomically(path, to_disk=to_disk) as file:
        file.write(text.encode())


@cache
def code_digest(*folders: str) -> str:
    """Return an identifier of the code in folders, for stored results: changed code makes other results."""
    digest = blake2b(digest_size=8)
    for folder in folders:
        for file in sorted(Path(folder).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()

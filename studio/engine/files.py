"""Writing files so that a crash leaves the old file or the new one, never half of one."""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from studio.engine.errors import StudioError


@contextmanager
def write_atomically(path: str | os.PathLike[str], *, to_disk: bool = True) -> Iterator[IO[bytes]]:
    """Yield a binary file that takes its place at `path` once the block ends without an error.

    Args:
        path: of the file.
        to_disk: it is on the disk by then, whatever happens to the machine; else that is left to `sync_files`.

    Raises:
        StudioError: the folder cannot be written, or the disk is full; nothing is left behind.
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
        reason = error.strerror or str(error)
        raise StudioError(
            f"cannot write {path}: {reason}; free some space or choose another place"
        ) from error
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def sync_files(folder: Path) -> None:
    """Have the files in a folder on the disk: one after the other is quicker than each as it is written, as the first
    takes along what the file system has of the others."""
    for path in folder.iterdir():
        with path.open("rb+") as file:
            os.fsync(file.fileno())


def write_json(path: str | os.PathLike[str], value: Any, *, to_disk: bool = True) -> None:
    """Write `value` as indented JSON, atomically; a number that is not finite is an error (ValueError)."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    with write_atomically(path, to_disk=to_disk) as file:
        file.write(text.encode())

"""A take as one file, to send or archive: a ZIP of its folder without exports, `<name>.take.zip`.

The reader does not trust the file: it extracts only files that a take has, names cannot leave the folder, and
announced sizes are checked against the extracted data.
"""

import json
import re
import shutil
import zipfile
from pathlib import Path
from typing import IO

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import write_atomically
from studio.take.folder.meta import TakeMeta
from studio.take.folder.names import is_safe_name
from studio.take.folder.new import new_take
from studio.take.folder.take import Take, check_meta
from studio.take.video.file import ENDINGS

ENDING = ".take.zip"
MAX_FILES = 50_000
"""Maximum number of files; videos are kept in files of ten seconds: three hours of eight cameras are 17,000 files."""
MAX_BYTES = 200 * 1024**3
MAX_META_BYTES = 16 << 20
MAX_RATIO, SMALL_BYTES = 100, 256 << 20
"""Largest compression ratio of files beyond `SMALL_BYTES` in all; a take's texts have 5 to 20."""

KEPT_FREE_BYTES = 256 << 20
"""Disk space that is left for recordings."""

_CHUNK = 1 << 20
_SUBFOLDERS = ("calibrations", "solves", "references", "video")
_STORED = (".mcap", ".npz", *ENDINGS)
"""Files that are compressed already."""

_FILE = re.compile(r"take\.json|edits\.json|raw[A-Za-z0-9_.-]*\.(mcap|jsonl)|[a-z]+/[^/]+(/[^/]+)?")


def write_bundle(take: Take, out: str | Path) -> int:
    """Write a take as one file; return its size [bytes].

    Raises:
        StudioError: the file cannot be written.
    """
    files = [
        path
        for path in sorted(take.path.rglob("*"))
        if path.is_file() and _belongs(path.relative_to(take.path))
    ]
    with write_atomically(out) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as bundle:
        for path in files:
            packed = zipfile.ZIP_STORED if path.suffix in _STORED else zipfile.ZIP_DEFLATED
            bundle.write(path, path.relative_to(take.path).as_posix(), packed)
    return Path(out).stat().st_size


def read_bundle(file: str | Path | IO[bytes], out: str | Path) -> Take:
    """Return a new take at `out` with the content of a bundle.

    Raises:
        FormatError: no bundle, a damaged one, or one with files that no take has.
        TakeError: `out` is not empty.
    """
    try:
        with zipfile.ZipFile(file) as bundle:
            members = _members(bundle)
            _check_disk(Path(out), sum(member.file_size for member in members))
            meta = _meta(bundle)
            with new_take(out, source=meta["source"], created=meta["created"]) as take:
                for member in members:
                    if member.filename != "take.json":
                        _extract(bundle, member, take.path)
                label = take.meta
                take.meta = meta.copy()
                for key in ("session", "name", "id"):
                    take.meta[key] = label[key]
                take.meta.pop("take_id", None)  # clients keep frames for the original only
            take.meta["recording"] = meta["recording"] if meta["recording"] != "recording" else "recovered"
            take.save_meta()
            return take
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        raise FormatError(
            "bundle.not_a_zip", "not a take as one file (ZIP), or a damaged one: {error}", error=error
        ) from error


def _belongs(path: Path) -> bool:
    """Whether a bundle includes this file of a take's folder."""
    text = path.as_posix()
    return (
        _FILE.fullmatch(text) is not None
        and all(is_safe_name(part) for part in path.parts)
        and (len(path.parts) == 1 or path.parts[0] in _SUBFOLDERS)
    )


def _members(bundle: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    members = [member for member in bundle.infolist() if not member.is_dir()]
    strange = [m.filename for m in members if not _belongs(Path(m.filename)) or m.filename.startswith("/")]
    if strange:
        raise FormatError(
            "bundle.strange_name",
            "the file holds {name!r}, which no take has; give a {kind} of this program",
            name=strange[0][:80],
            kind=ENDING,
        )
    if len(members) > MAX_FILES or sum(member.file_size for member in members) > MAX_BYTES:
        raise FormatError(
            "bundle.too_much",
            "the file holds over {n} files or {size} GB; no take is so large",
            n=MAX_FILES,
            size=MAX_BYTES >> 30,
        )
    unpacked, packed = (sum(getattr(m, size) for m in members) for size in ("file_size", "compress_size"))
    if unpacked > max(SMALL_BYTES, MAX_RATIO * packed):
        raise FormatError(
            "bundle.grows",
            "the file would grow from {small} kB to {large} MB, as no take does; give one that "
            "this program made",
            small=packed >> 10,
            large=unpacked >> 20,
        )
    if len({member.filename for member in members}) != len(members):
        raise FormatError("bundle.name_twice", "the file holds a name twice; give one that this program made")
    return members


def _check_disk(out: Path, size: int) -> None:
    folder = next(parent for parent in out.absolute().parents if parent.is_dir())
    free = shutil.disk_usage(folder).free
    if size > free - KEPT_FREE_BYTES:
        raise StudioError(
            "bundle.no_space",
            "the take needs {size} MB and {folder} has {free} MB left; free some space",
            size=size >> 20,
            folder=folder,
            free=free >> 20,
        )


def _meta(bundle: zipfile.ZipFile) -> TakeMeta:
    try:
        with bundle.open("take.json") as file:
            meta = json.loads(_Bounded(file, MAX_META_BYTES).read(MAX_META_BYTES + 1))
    except (KeyError, ValueError, RecursionError) as error:
        raise FormatError(
            "bundle.no_take_json", "the file has no take.json that can be read: {error}", error=error
        ) from error
    try:
        check_meta(Path("take.json"), meta)
    except StudioError as error:
        raise FormatError(error.sentence) from error
    return meta


def _extract(bundle: zipfile.ZipFile, member: zipfile.ZipInfo, folder: Path) -> None:
    path = folder / member.filename
    path.parent.mkdir(parents=True, exist_ok=True)
    with bundle.open(member) as source, path.open("wb") as target:
        shutil.copyfileobj(_Bounded(source, member.file_size), target, _CHUNK)


class _Bounded:
    """Reads from a file, at most as many bytes as announced."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._left = file, size

    def read(self, size: int = -1) -> bytes:
        data = self._file.read(size)
        self._left -= len(data)
        if self._left < 0:
            raise FormatError(
                "bundle.larger_than_said",
                "a file in the ZIP is larger than it says; give one that this program made",
            )
        return data

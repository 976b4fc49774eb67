"""Arrays of a `.npz` that somebody else may have made: nothing is unpacked that grows beyond all measure."""

import mmap
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.engine.versions import KEY, FileFormat

MAX_BYTES = 4 << 30
"""An hour of poses at 120 Hz has 1.6 GB."""

SMALL_BYTES, MAX_RATIO = 256 << 20, 200
"""Beyond `SMALL_BYTES`, poses shrink to a half; only what is alike from end to end shrinks to a hundredth."""

PIECE_BYTES = 8 << 20
"""What is written at once."""


def save_arrays(file: IO[bytes], arrays: Mapping[str, ArrayLike], kind: FileFormat) -> None:
    """Write arrays as a compressed `.npz` of the kind's version.

    Of arrays that are mapped from a file, only a piece is in memory at a time.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for key, value in {KEY: np.int64(kind.version), **arrays}.items():
            with archive.open(f"{key}.npy", "w", force_zip64=True) as member:
                _write(member, np.asanyarray(value))


def _write(member: IO[bytes], array: NDArray) -> None:
    header = {**np.lib.format.header_data_from_array_1_0(array), "fortran_order": False}
    np.lib.format.write_array_header_1_0(member, header)
    for piece in [array] if array.ndim == 0 else pieces(array):
        member.write(piece.tobytes())


def pieces(array: NDArray) -> Iterator[NDArray]:
    """Yield an array by its first axis, a piece at a time: of a mapped one, no more than a piece is in memory."""
    step = max(1, PIECE_BYTES // max(array[:1].nbytes, 1))
    for begin in range(0, len(array), step):
        yield array[begin : begin + step]
        _let_go(array)


def _let_go(array: NDArray) -> None:
    """Give the pages of a mapped array back to the system; what they hold stays in the file."""
    owner = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        owner.madvise(mmap.MADV_DONTNEED)


def read_arrays(
    path: str | os.PathLike[str], keys: Sequence[str], kind: FileFormat, *, optional: Sequence[str] = ()
) -> dict[str, NDArray]:
    """Return the arrays of these names in a `.npz` of any version of its kind; pickled objects are refused.

    Args:
        keys: arrays that must be there.
        optional: arrays that are left out where the file lacks them.

    Raises:
        FormatError: of a later version.
        ValueError: no `.npz`, or one that would grow too large.
        KeyError, OSError, EOFError, zipfile.BadZipFile, zlib.error: a name is missing, or the file is damaged.
    """
    with open(path, "rb") as file:
        if zipfile.is_zipfile(file):
            with zipfile.ZipFile(file) as archive:
                members = archive.infolist()
            size = sum(member.file_size for member in members)
            packed = sum(member.compress_size for member in members)
            if size > MAX_BYTES or size > max(SMALL_BYTES, MAX_RATIO * packed):
                raise ValueError(f"it would grow from {packed >> 10} kB to {size >> 20} MB")
        file.seek(0)
        with np.load(file, allow_pickle=False) as data:
            version = {KEY: int(data[KEY])} if KEY in data.files else {}
            there = [key for key in (*keys, *optional) if key in data.files]
            found = kind.current({**{key: data[key] for key in there}, **version}, path)
    return {key: found[key] for key in (*keys, *(key for key in optional if key in found))}

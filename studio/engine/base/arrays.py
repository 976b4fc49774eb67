"""Arrays: runs of flags; `.npz` files, whose reading refuses one that would unpack to too much memory."""

import mmap
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.engine.base.versions import KEY, FileFormat

MAX_BYTES = 4 << 30
"""Largest size of an unpacked file. An hour of poses at 120 Hz has 1.6 GB."""

SMALL_BYTES, MAX_RATIO = 256 << 20, 200
"""Largest compression ratio of files above `SMALL_BYTES`. Poses compress to a half; only constant data to a
hundredth."""

PIECE_BYTES = 8 << 20
"""Bytes written at a time."""


def save_arrays(file: IO[bytes], arrays: Mapping[str, ArrayLike], kind: FileFormat) -> None:
    """Write arrays as a compressed `.npz` of the kind's version.

    Arrays that are mapped from a file are read piece by piece, so that they need not fit into memory.
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
    """Yield an array in pieces along its first axis. Only one piece of a mapped array is in memory at a time."""
    step = max(1, PIECE_BYTES // max(array[:1].nbytes, 1))
    for begin in range(0, len(array), step):
        yield array[begin : begin + step]
        _let_go(array)


def _let_go(array: NDArray) -> None:
    """Return the pages of a mapped array to the system; the file keeps their content."""
    owner = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        owner.madvise(mmap.MADV_DONTNEED)


def read_arrays(
    path: str | os.PathLike[str], keys: Sequence[str], kind: FileFormat, *, optional: Sequence[str] = ()
) -> dict[str, NDArray]:
    """Return arrays of a `.npz` by name. Every version of its kind is read; pickled objects are refused.

    Args:
        keys: required arrays.
        optional: arrays that may be missing.

    Raises:
        FormatError: the file has a later version.
        ValueError: it is no `.npz`, or unpacks to too much memory.
        KeyError, OSError, EOFError, zipfile.BadZipFile, zlib.error: an array is missing, or the file is damaged.
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


def runs(flags: NDArray[np.bool_], first: int = 0) -> list[tuple[int, int]]:
    """Return begin and end (one past the last) of each run of true flags; `first`: the place of the first flag."""
    edges = first + np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]

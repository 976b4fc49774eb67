"""Arrays of a `.npz` that somebody else may have made: nothing is unpacked that grows beyond all measure."""

import os
import zipfile
from collections.abc import Mapping, Sequence
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.engine.versions import KEY, FileFormat

MAX_BYTES = 4 << 30
"""An hour of poses at 120 Hz has 1.6 GB."""

SMALL_BYTES, MAX_RATIO = 256 << 20, 200
"""Beyond `SMALL_BYTES`, poses shrink to a half; only what is alike from end to end shrinks to a hundredth."""


def save_arrays(file: IO[bytes], arrays: Mapping[str, ArrayLike], kind: FileFormat) -> None:
    """Write arrays as a compressed `.npz` of the kind's version."""
    np.savez_compressed(file, **{KEY: np.int64(kind.version), **arrays})


def read_arrays(path: str | os.PathLike[str], keys: Sequence[str], kind: FileFormat) -> dict[str, NDArray]:
    """Return the arrays of these names in a `.npz` of any version of its kind; pickled objects are refused.

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
            found = kind.current({**{key: data[key] for key in keys if key in data.files}, **version}, path)
    return {key: found[key] for key in keys}

"""Runs a file reader in a separate process, so that a damaged or hostile file can crash only that process.

A worker is a module of this package, run as `python -m MODULE FILE OUT.npz`. For a wrong file it prints
`FormatError: ...` and exits with 1. Its time, its memory and the size of its result are limited.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError, NotAvailableError
from studio.engine.base.file_sentences import too_large, unreadable_give_other
from studio.engine.base.sentences import Said
from studio.engine.base.system import limit_memory

MAX_BYTES = 1 << 30
"""Largest file."""

MAX_VALUES = 50_000_000
"""Largest number of frames times nodes of an animation."""

_MEMORY_BYTES = 6 << 30
_TIMEOUT_S = 600.0
_ROOT = Path(__file__).parents[4]
_ERRORS = {"FormatError": FormatError, "NotAvailableError": NotAvailableError}


def read_apart(worker: str, path: Path) -> dict[str, NDArray[Any]]:
    """Return a worker's arrays for a file.

    Args:
        worker: name of its module in this package.
        path: of the file.

    Raises:
        FormatError: the file is missing or too large, or the worker refuses it or crashes.
        NotAvailableError: the worker lacks its library.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FormatError(too_large(path, MAX_BYTES))
        with path.open("rb"):
            pass
    except OSError as error:
        raise FormatError(unreadable_give_other(path, error)) from error
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "read.npz"
        command = [sys.executable, "-m", f"{__package__}.{worker}", str(path), str(out)]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), *filter(None, sys.path)])}
        try:
            run = subprocess.run(
                command, capture_output=True, text=True, errors="replace", timeout=_TIMEOUT_S, env=environment
            )
        except subprocess.TimeoutExpired as error:
            raise FormatError(
                "animation.too_slow",
                "{path} was not read within {seconds:g} s; is it damaged?",
                path=path,
                seconds=_TIMEOUT_S,
            ) from error
        if run.returncode != 0:
            raise _error(path, run.stderr)
        with np.load(out, allow_pickle=False) as data:
            return {key: data[key] for key in data.files}


def _error(path: Path, said: str) -> FormatError | NotAvailableError:
    last = said.strip().splitlines()[-1:] or [""]
    kind, _, message = last[0].partition(": ")
    if kind in _ERRORS and message:
        said = json.loads(message)
        return _ERRORS[kind](said if isinstance(said, str) else Said.from_json(said))
    return FormatError(
        "animation.reader_broke",
        "{path} is damaged or not of its kind: its reader broke over it; export it again",
        path=path,
    )


def work(read: Callable[[Path], dict[str, Any]]) -> None:
    """Run a worker's `read(path) -> arrays` on the command line's FILE and write OUT.npz."""
    limit_memory(_MEMORY_BYTES)
    path, out = Path(sys.argv[1]), Path(sys.argv[2])
    try:
        arrays = read(path)
    except (FormatError, NotAvailableError) as error:
        said = error.sentence
        text = said.to_json() if isinstance(said, Said) else " ".join(said.split())
        print(f"{type(error).__name__}: {json.dumps(text)}", file=sys.stderr)
        sys.exit(1)
    np.savez(out, **arrays)

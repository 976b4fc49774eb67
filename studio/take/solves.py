"""Writing a solve into a take: the whole folder takes its place at once."""

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

from studio.engine.errors import TakeError
from studio.engine.files import write_json
from studio.engine.poses import Poses
from studio.engine.settings import SolveSettings
from studio.engine.solve.trace import Trace
from studio.take.take import Take

TRACE = "trace.npz"
"""What the frames of a solve were made of; the solve `live` and imported ones have none."""


def write_solve(
    take: Take,
    name: str,
    *,
    settings: SolveSettings,
    poses: Poses,
    metrics: dict[str, Any],
    trace: Trace | None = None,
) -> Path:
    """Write `solves/<name>/` with settings.json, poses.npz, metrics.json and trace.npz; return the folder.

    A solve of that name is replaced; an error leaves it as it was and nothing half-written behind.

    Raises:
        TakeError: a name that is not allowed, or a folder that cannot be written.
        StudioError: see `files.write_atomically`.
    """
    folder = take.solve_folder(name)
    temporary: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{name}.partial-", dir=folder.parent))
        os.chmod(temporary, 0o755)
        poses.save(temporary / "poses.npz")
        if trace is not None:
            trace.save(temporary / TRACE)
        write_json(temporary / "settings.json", settings.to_json())
        write_json(temporary / "metrics.json", metrics)
        _replace(folder, temporary)
    except OSError as error:
        reason = error.strerror or str(error)
        raise TakeError(f"cannot write solve {name!r} of {take.path}: {reason}; free some space") from error
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
    return folder


def _replace(folder: Path, new: Path) -> None:
    """Put `new` in the place of `folder`, which may exist."""
    if not folder.exists():
        new.rename(folder)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{folder.name}.old-", dir=folder.parent))
    try:
        folder.rename(old)
        new.rename(folder)
    except OSError:
        if not folder.exists():
            old.rename(folder)
        raise
    finally:
        shutil.rmtree(old, ignore_errors=True)

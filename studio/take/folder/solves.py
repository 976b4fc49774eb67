"""Atomic writing of a solve into a take, and reading of its settings and figures."""

import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.base.files import sync_files, write_json
from studio.engine.base.sentences import system_says
from studio.engine.base.versions import METRICS, SETTINGS, FileFormat
from studio.engine.edits.edit import RetimeEdit
from studio.engine.edits.time_map import TimeMap
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SettingsJson, SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.model.spans import Span
from studio.engine.whole_take.trace import Trace
from studio.take.folder.names import check_name
from studio.take.folder.take import POSES, Take

TRACE = "trace.npz"
"""Inputs of a solve's frames; the solve `live` and imported solves have none."""


@dataclass(frozen=True)
class Solved:
    """One performer's part of a solve: poses, figures, and the inputs of its frames."""

    poses: Poses
    metrics: SolveMetrics
    trace: Trace | None = None


def write_solve(
    take: Take,
    name: str,
    *,
    settings: SolveSettings,
    poses: Poses,
    metrics: SolveMetrics,
    trace: Trace | None = None,
    to_disk: bool = True,
) -> Path:
    """Write `solves/<name>/` with settings.json, poses.npz, metrics.json and trace.npz; return the folder.

    Like `write_performers`, for a single performer.
    """
    only = {"": Solved(poses, metrics, trace)}
    return write_performers(take, name, settings=settings, performers=only, metrics=metrics, to_disk=to_disk)


def write_performers(
    take: Take,
    name: str,
    *,
    settings: SolveSettings,
    performers: Mapping[str, Solved],
    metrics: SolveMetrics,
    to_disk: bool = True,
) -> Path:
    """Write `solves/<name>/` with settings.json and metrics.json, and for each performer a folder of their name with
    poses.npz, metrics.json and trace.npz; return the folder.

    A solve of that name is replaced; an error leaves it unchanged. Without `to_disk`, the data may not be on the disk
    yet.

    Args:
        performers: by name; the name "" stands for the only one, whose files lie in `solves/<name>/` itself.
        metrics: of all.

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
        for performer, solved in performers.items():
            own = temporary / check_name("performer", performer) if performer else temporary
            own.mkdir(exist_ok=True)
            solved.poses.save(own / POSES, to_disk=False)
            if solved.trace is not None:
                solved.trace.save(own / TRACE, to_disk=False)
            write_json(own / "metrics.json", METRICS.stamped(solved.metrics), to_disk=False)
        write_json(temporary / "settings.json", SETTINGS.stamped(settings.to_json()), to_disk=False)
        write_json(temporary / "metrics.json", METRICS.stamped(metrics), to_disk=False)
        if to_disk:
            sync_files(temporary)
        _replace(folder, temporary)
    except OSError as error:
        raise TakeError(
            "take.solve_unwritable",
            "cannot write solve {name!r} of {take}: {reason}; free some space",
            name=name,
            take=take.path,
            reason=system_says(error),
        ) from error
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
    return folder


def read_settings(folder: Path) -> SettingsJson | None:
    """Return the settings of the solve in a folder; None if they cannot be read."""
    return _read(folder / "settings.json", SETTINGS)


def read_metrics(folder: Path) -> SolveMetrics | None:
    """Return the metrics of the solve in a folder; None if they cannot be read."""
    return _read(folder / "metrics.json", METRICS)


def solve_disagreements(folder: Path) -> dict[str, list[Span]]:
    """Return by camera the spans of stage time in which it disagreed with the others in a solve; may be empty."""
    found = (read_metrics(folder) or {}).get("disagrees", {})
    try:
        return {str(name): [Span.from_json(span) for span in spans] for name, spans in found.items()}
    except (AttributeError, KeyError, TypeError, ValueError):
        return {}


def undecided_spans(folder: Path) -> list[tuple[float, float]]:
    """Return the spans of stage time [s] in which the performer of a folder was not told apart from another; may be
    empty."""
    found = (read_metrics(folder) or {}).get("undecided_s", [])
    try:
        return [(float(begin), float(end)) for begin, end in found]
    except (TypeError, ValueError):
        return []


def solve_camera_moves(folder: Path) -> dict[str, tuple[float, float]]:
    """Return by camera how far it was moved [mm] and turned [degrees] before a solve; empty if unknown."""
    found = (read_metrics(folder) or {}).get("cameras_moved", {})
    try:
        return {str(name): (float(one["moved_mm"]), float(one["turned_deg"])) for name, one in found.items()}
    except (AttributeError, KeyError, TypeError, ValueError):
        return {}


def time_map(take: Take, solve: str) -> TimeMap:
    """Return the map from a solve's time to stage time: the identity, except where its edits retime parts."""
    found = (read_metrics(take.solve_folder(solve)) or {}).get("retimed", [])
    try:
        return TimeMap([RetimeEdit(id=str(k), **one) for k, one in enumerate(found)])
    except (TypeError, ValueError):
        return TimeMap([])


def _read(file: Path, kind: FileFormat) -> Any:
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
        return kind.current(value, file) if isinstance(value, dict) else None
    except (OSError, ValueError, RecursionError, FormatError):
        return None


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

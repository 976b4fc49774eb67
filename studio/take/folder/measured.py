"""Measured figures of a solve, kept with it in `measured.json`, so that takes are found by them.

They are derived: they go with the solve; those against a reference go when it or its alignment changes.
"""

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypedDict

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import write_json
from studio.engine.base.versions import MEASURED_FIGURES
from studio.take.folder.solves import read_metrics
from studio.take.folder.take import POSES

MEASURED = "measured.json"
_OWN = {"jitter": "jitter_mm", "slide": "own_stance_foot_slide_cm_s", "edits": "cleanup_events_per_min"}
_AGAINST = {"error": "mpjpe_mm"}


class _Kept(TypedDict):
    """Figures by name: the solve's own, and by reference."""

    own: dict[str, Any]
    references: dict[str, dict[str, Any]]


def keep_measured(
    solve: Path, own: Mapping[str, Any] | None, against: Mapping[str, Mapping[str, Any]]
) -> None:
    """Keep figures of the solve in a folder: its own, and those against references by their names.

    Figures against other references stay. A folder that cannot be written keeps nothing.
    """
    kept = _read(solve)
    references = {**kept["references"], **{name: _numbers(figures) for name, figures in against.items()}}
    _write(solve, {"own": kept["own"] if own is None else _numbers(own), "references": references})


def forget_measured(solve: Path, reference: str) -> None:
    """Delete the figures of a solve against a reference that has changed."""
    kept = _read(solve)
    if kept["references"].pop(reference, None) is not None:
        _write(solve, kept)


def measured_figures(solve: Path) -> Iterator[tuple[str, float]]:
    """Yield a solve's figures for searches: `jumps` and, if measured, `jitter` [mm], `slide` [cm/s], `edits` [1/min]
    and, once for each reference, `error` [mm]; with several performers, those of each."""
    for folder in (solve, *sorted(file.parent for file in solve.glob(f"*/{POSES}"))):
        yield from _figures_in(folder)


def _figures_in(solve: Path) -> Iterator[tuple[str, float]]:
    """Yield the figures of a folder with poses."""
    jumps = (read_metrics(solve) or {}).get("jumps")
    if jumps is not None and _is_number(jumps):
        yield "jumps", float(jumps)
    kept = _read(solve)
    for name, key in _OWN.items():
        if _is_number(kept["own"].get(key)):
            yield name, kept["own"][key]
    for figures in kept["references"].values():
        for name, key in _AGAINST.items():
            if _is_number(figures.get(key)):
                yield name, figures[key]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _numbers(figures: Mapping[str, Any]) -> dict[str, float]:
    return {key: value for key, value in figures.items() if _is_number(value)}


def _read(solve: Path) -> _Kept:
    """Return the kept figures; none if the file is missing or damaged."""
    file = solve / MEASURED
    try:
        value = MEASURED_FIGURES.current(json.loads(file.read_text(encoding="utf-8")), file)
        own, references = value["own"], value["references"]
        if isinstance(own, dict) and all(isinstance(figures, dict) for figures in references.values()):
            return {"own": own, "references": references}
    except (OSError, ValueError, RecursionError, FormatError, KeyError, TypeError, AttributeError):
        pass
    return {"own": {}, "references": {}}


def _write(solve: Path, value: _Kept) -> None:
    try:
        if solve.is_dir():
            write_json(solve / MEASURED, MEASURED_FIGURES.stamped(value), to_disk=False)
            os.utime(solve.parent)  # the index of takes checks the solve's folder, not a performer's
    except (StudioError, ValueError, OSError):
        return

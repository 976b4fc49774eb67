"""Damage of the stage's own files in the folder of sessions: calibrations, performers, camera tokens, outputs,
presets.

A file that is no JSON is moved aside, so that the studio starts without it. Incomplete files of a killed program are
deleted.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from studio.engine.base.errors import CalibrationError
from studio.engine.model.calibration import Calibration

_FILES = {
    "access.json": "pair the cameras again",
    "outputs.json": "add the outputs again",
    "presets.json": "save the presets again",
    "calibrations/*.json": "the last good calibration is in use; else calibrate again",
    "performers/*.json": "measure the performer again",
}
"""Patterns below the folder of sessions, and the advice for a lost file."""


@dataclass(frozen=True)
class Damage:
    """A damaged file: its damage, and the action taken or advised."""

    path: Path
    problem: str
    action: str


def check_stage_files(sessions: Path, *, repair: bool) -> list[Damage]:
    """Return the damaged files of the stage; those that are no JSON are moved aside unless `repair` is off."""
    found = []
    for pattern, again in _FILES.items():
        for file in sorted(sessions.glob(pattern)):
            problem = _problem(file)
            if problem and repair:
                aside = file.with_name(f"{file.name}.damaged")
                file.rename(aside)
                found.append(Damage(file, problem, f"put aside as {aside.name}; {again}"))
            elif problem:
                found.append(Damage(file, problem, f"run `studio doctor {sessions}`; {again}"))
        place = sessions / pattern
        for file in sorted(place.parent.glob(f".{place.name}.*")):
            if repair:
                file.unlink(missing_ok=True)
            text = "a program was killed while it wrote, and left this"
            found.append(Damage(file, text, "removed" if repair else f"run `studio doctor {sessions}`"))
    return found


def _problem(file: Path) -> str:
    """Return why a file cannot be read; "" if it can."""
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
        if file.parent.name == "calibrations":
            Calibration.from_json(value)
        elif not isinstance(value, dict | list):
            return "it holds neither an object nor a list"
    except (OSError, ValueError, RecursionError, CalibrationError) as error:
        return f"it cannot be read: {error}"
    return ""

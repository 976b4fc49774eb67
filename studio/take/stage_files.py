"""Damage of the stage's own files in the folder of sessions: calibrations, performers, camera tokens, outputs,
presets.

A file that is no JSON is put aside, so that the studio starts without it; what a killed program left half written is
removed.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from studio.engine.calibration.result import Calibration
from studio.engine.errors import CalibrationError

_FILES = {
    "access.json": "pair the cameras again",
    "outputs.json": "add the outputs again",
    "presets.json": "save the presets again",
    "calibrations/*.json": "the last good calibration is in use; else calibrate again",
    "performers/*.json": "measure the performer again",
}
"""Patterns below the folder of sessions, and what to do where such a file is lost."""


@dataclass(frozen=True)
class Damage:
    """A damaged file: what is wrong with it, and what was done or is to be done."""

    path: Path
    problem: str
    action: str


def check_stage_files(sessions: Path, *, repair: bool) -> list[Damage]:
    """Return the damaged files of the stage; those that are no JSON are put aside unless `repair` is off."""
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
    """Return why a file cannot be read; "" where it can."""
    try:
        value = json.loads(file.read_text(encoding="utf-8"))
        if file.parent.name == "calibrations":
            Calibration.from_json(value)
        elif not isinstance(value, dict | list):
            return "it holds neither an object nor a list"
    except (OSError, ValueError, RecursionError, CalibrationError) as error:
        return f"it cannot be read: {error}"
    return ""

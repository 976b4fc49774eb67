"""The stage's own calibrations on disk: `sessions/calibrations/<n>.json`, good ones only, none overwritten.

In these files a camera's `clock` maps from its clock as the exchanges with the server place it to the stage
clock, so that `offset_ns` is the constant latency correction of its device and stays true after a restart.
"""

import json
import logging
from pathlib import Path

from studio.engine.calibration.result import Calibration
from studio.engine.errors import CalibrationError
from studio.engine.files import write_json

_log = logging.getLogger(__name__)


def _numbers(folder: Path) -> list[int]:
    stems = [file.stem for file in folder.glob("*.json")]
    return sorted(int(stem) for stem in stems if stem.isascii() and stem.isdigit())


def save_calibration(folder: Path, calibration: Calibration) -> int:
    """Write the calibration under the next number, which comes back.

    Raises:
        StudioError: the folder cannot be written.
    """
    number = max(_numbers(folder), default=0) + 1
    write_json(folder / f"{number}.json", calibration.to_json())
    return number


def load_last_calibration(folder: Path) -> tuple[int, Calibration] | None:
    """Return the newest calibration that can be read and was not refused, with its number, or None."""
    for number in reversed(_numbers(folder)):
        file = folder / f"{number}.json"
        try:
            calibration = Calibration.from_json(json.loads(file.read_text(encoding="utf-8")))
        except (OSError, ValueError, RecursionError, CalibrationError) as error:
            _log.warning("calibration %s cannot be read and is passed over: %s", file, error)
            continue
        if not calibration.refused and calibration.performer is not None:
            return number, calibration
    return None

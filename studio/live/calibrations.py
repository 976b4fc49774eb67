"""The stage's own calibrations on disk: `sessions/calibrations/<n>.json`, good ones only, none overwritten.

In these files a camera's `clock` maps from its clock as the exchanges with the server place it to the stage
clock, so that `offset_ns` is the constant latency correction of its device and stays true after a restart.
"""

import json
import logging
from dataclasses import dataclass, field
from pathlib import Path

from studio.engine.calibration.result import Calibration
from studio.engine.errors import CalibrationError
from studio.engine.files import write_json
from studio.take.take import utc_now

_log = logging.getLogger(__name__)


def _numbers(folder: Path) -> list[int]:
    stems = [file.stem for file in folder.glob("*.json")]
    return sorted(int(stem) for stem in stems if stem.isascii() and stem.isdigit())


BORROWED = 0
"""Number of a calibration that a recording brought, and that is not on disk."""


@dataclass(frozen=True)
class Kept:
    """A calibration of the stage: its number, when it was made (ISO 8601, UTC), and of which devices.

    `devices`: serial numbers by camera, empty where a device has none; None where the file does not say.
    """

    number: int
    calibration: Calibration
    created: str = ""
    devices: dict[str, str] | None = field(default=None)


def save_calibration(
    folder: Path, calibration: Calibration, devices: dict[str, str] | None, created: str | None = None
) -> Kept:
    """Keep the calibration, of these devices (serial numbers by camera), under the next number.

    `created`: when the cameras were calibrated (ISO 8601, UTC), now where None.

    Raises:
        StudioError: the folder cannot be written.
    """
    number = max(_numbers(folder), default=0) + 1
    kept = Kept(number, calibration, created or utc_now(), devices)
    origin = {"created": kept.created, "devices": devices}
    write_json(folder / f"{number}.json", {**calibration.to_json(), **origin})
    return kept


def load_last_calibration(folder: Path) -> Kept | None:
    """Return the newest calibration that can be read and was not refused, or None."""
    for number in reversed(_numbers(folder)):
        file = folder / f"{number}.json"
        try:
            value = json.loads(file.read_text(encoding="utf-8"))
            calibration = Calibration.from_json(value)
            devices = value.get("devices")
            kept = Kept(
                number,
                calibration,
                str(value.get("created", "")),
                None if devices is None else {str(name): str(serial) for name, serial in devices.items()},
            )
        except (OSError, ValueError, AttributeError, RecursionError, CalibrationError) as error:
            _log.warning("calibration %s cannot be read and is passed over: %s", file, error)
            continue
        if not calibration.refused and calibration.performer is not None:
            return kept
    return None

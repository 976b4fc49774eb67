"""The stage's own calibrations on disk: `sessions/calibrations/<n>.json`, good ones only, never overwritten.

In these files a camera's `clock` maps from its clock, as placed by the exchanges with the server, to the stage
clock. `offset_ns` is thus the constant latency correction of its device and stays valid after a restart.
"""

import json
import logging
from dataclasses import dataclass, field
from pathlib import Path

from studio.engine.base.errors import CalibrationError
from studio.engine.base.files import write_json
from studio.engine.model.calibration import Calibration
from studio.take.folder.take import utc_now

_log = logging.getLogger(__name__)


def _numbers(folder: Path) -> list[int]:
    stems = [file.stem for file in folder.glob("*.json")]
    return sorted(int(stem) for stem in stems if stem.isascii() and stem.isdigit())


BORROWED = 0
"""Number of a recording's calibration, which is not on disk."""


@dataclass(frozen=True)
class KeptCalibration:
    """A calibration of the stage: its number, its time (ISO 8601, UTC), and its devices.

    `devices`: serial numbers by camera, empty where a device has none; None where the file has none.
    """

    number: int
    calibration: Calibration
    created: str = ""
    devices: dict[str, str] | None = field(default=None)


def save_calibration(
    folder: Path, calibration: Calibration, devices: dict[str, str] | None, created: str | None = None
) -> KeptCalibration:
    """Store the calibration, of these devices (serial numbers by camera), under the next number.

    `created`: when the cameras were calibrated (ISO 8601, UTC), now where None.

    Raises:
        StudioError: the folder cannot be written.
    """
    number = max(_numbers(folder), default=0) + 1
    kept = KeptCalibration(number, calibration, created or utc_now(), devices)
    origin = {"created": kept.created, "devices": devices}
    write_json(folder / f"{number}.json", {**calibration.to_json(), **origin})
    return kept


def load_last_calibration(folder: Path) -> KeptCalibration | None:
    """Return the newest calibration that can be read, was not refused and has a performer, or None."""
    for number in reversed(_numbers(folder)):
        file = folder / f"{number}.json"
        try:
            value = json.loads(file.read_text(encoding="utf-8"))
            calibration = Calibration.from_json(value)
            devices = value.get("devices")
            kept = KeptCalibration(
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

"""The simulated stage is calibrated by itself, once."""

import logging

from studio.engine.errors import StudioError
from studio.live import LiveStage

_log = logging.getLogger(__name__)

ATTEMPTS = 3


class CalibratesOnce:
    """Begins a calibration, once all cameras are here, where there is none.

    The performer walks about and holds a T-pose between any two movements, whenever it begins.
    """

    def __init__(self, stage: LiveStage) -> None:
        self._stage = stage
        self._attempts = 0

    def try_now(self, names: list[str]) -> None:
        """Calibrate these cameras, unless they are not ready, it was done before, or it failed too often."""
        status = self._stage.status()
        calibration = status["calibration"]
        cameras = [status["cameras"].get(name, {"state": "gone"}) for name in names]
        if self._attempts == ATTEMPTS or calibration["state"] == "good":
            return
        if any(camera["state"] != "live" or camera["clock"]["source"] != "exchange" for camera in cameras):
            return
        if calibration["attempt"]["state"] not in ("idle", "failed"):
            return
        self._attempts += 1
        try:
            self._stage.start_calibration()
        except StudioError as error:
            _log.warning("the simulated stage was not calibrated: %s", error)

"""Automatic calibration of the simulated stage, once."""

import logging

from studio.engine.base.errors import StudioError
from studio.live import LiveStage

_log = logging.getLogger(__name__)

ATTEMPTS = 3


class CalibratesOnce:
    """Starts a calibration, once all cameras are connected, if there is none.

    The performer walks about and holds a T-pose between any two movements, so it may start at any time.
    """

    def __init__(self, stage: LiveStage) -> None:
        self._stage = stage
        self._attempts = 0

    def try_now(self, names: list[str]) -> None:
        """Calibrate these cameras, unless they are not ready, it was done before, or it failed too often."""
        status = self._stage.status()
        calibration = status.calibration
        if self._attempts == ATTEMPTS or calibration.state == "good":
            return
        here = [status.cameras[name] for name in names if name in status.cameras]
        ready = [camera for camera in here if camera.state == "live" and camera.clock.source == "exchange"]
        if len(ready) < len(names) or calibration.attempt.state not in ("idle", "failed"):
            return
        self._attempts += 1
        try:
            self._stage.start_calibration()
        except StudioError as error:
            _log.warning("the simulated stage was not calibrated: %s", error)

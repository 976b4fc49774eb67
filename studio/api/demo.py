"""The simulated stage: two camera clients as processes of their own, kept running, calibrated once."""

import logging
import math
import os
import subprocess
import sys
import threading

from studio.engine.errors import StudioError
from studio.engine.motion.authored import demo_motion
from studio.live import LiveStage

_log = logging.getLogger(__name__)

CAMERAS = 2
CHECK_S = 0.5
ATTEMPTS = 3
SLOWEST_RESTART_S = 10.0
STOP_S = 3.0


class DemoCameras:
    """Starts the cameras, starts them again when they end, and begins a calibration where there is none."""

    def __init__(self, stage: LiveStage, url: str, token: str) -> None:
        self._thread = threading.Thread(target=self._run, name="demo", daemon=True)
        self._stage = stage
        self._url = url
        self._spool = stage.sessions / ".spool"
        self._token = token
        self._stopped = threading.Event()
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._attempts = 0

    def start(self) -> None:
        """Start the cameras and the thread that looks after them."""
        self._thread.start()

    def _run(self) -> None:
        pause_s = CHECK_S
        while not self._stopped.is_set():
            ended = self._start_missing()
            pause_s = min(2 * pause_s, SLOWEST_RESTART_S) if ended else CHECK_S
            self._calibrate()
            self._stopped.wait(pause_s)

    def end(self) -> None:
        """Ask the cameras to stop; does not wait."""
        self._stopped.set()
        for process in list(self._processes.values()):
            process.terminate()

    def close(self) -> None:
        """Stop the cameras."""
        self._stopped.set()
        if self._thread.is_alive():
            self._thread.join()
        self.end()
        for process in self._processes.values():
            try:
                process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def _start_missing(self) -> bool:
        """Start every camera that is not running; return whether one had ended."""
        ended = False
        for index in range(CAMERAS):
            name = f"camera_{index}"
            process = self._processes.get(name)
            if process is not None and process.poll() is None:
                continue
            if process is not None:
                ended = True
                _log.warning("simulated %s ended with code %d and is started again", name, process.returncode)
            source = f"simulated:{index}/{CAMERAS}"
            kept = ["--spool", str(self._spool / name), "--parent", str(os.getpid())]
            command = [sys.executable, "-m", "studio", "camera", "--source", source]
            self._processes[name] = subprocess.Popen(
                [*command, "--server", self._url, "--name", name, *kept],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**os.environ, "STUDIO_CAMERA_TOKEN": self._token},
                start_new_session=True,  # Ctrl-C is for the server, which stops them
            )
        return ended

    def _calibrate(self) -> None:
        """Calibrate with one round of the performance once all cameras are here, unless it was done before."""
        status = self._stage.status()
        calibration = status["calibration"]
        cameras = [camera for camera in status["cameras"].values() if camera["state"] == "live"]
        if self._attempts == ATTEMPTS or calibration["state"] == "good" or len(cameras) < CAMERAS:
            return
        if calibration["attempt"]["state"] not in ("idle", "failed"):
            return
        if all(camera["clock"]["source"] == "exchange" for camera in cameras):
            self._attempts += 1
            try:
                self._stage.start_calibration(math.ceil(demo_motion().duration_s))
            except StudioError as error:
                _log.warning("the simulated stage was not calibrated: %s", error)

"""Camera clients on the server's own machine: the simulated stage, or a recording played as cameras.

Each is a separate process, like a client on another machine; one that ends is started again.
"""

import logging
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from msgspec import Struct

from studio.api.cameras.client_process import SPOOL, ClientProcess, refuse_taken
from studio.api.cameras.demo import CalibratesOnce
from studio.api.cameras.simulated import SIMULATED
from studio.engine.model.calibration import Calibration
from studio.live import LiveStage

_log = logging.getLogger(__name__)

CHECK_S = 0.5
SLOWEST_RESTART_S = 10.0


class LocalClientStatus(Struct):
    """A camera client on the server's machine: whether it runs, and why it last ended."""

    running: bool
    problem: str


class LocalCamerasStatus(Struct):
    """What is open, `simulated`, a recording or None; its clients by camera; how many performers are simulated."""

    opened: str | None
    cameras: dict[str, LocalClientStatus]
    performers: int = 1


@dataclass
class _Client:
    """One camera client: its source, its process, and the reason of its last end."""

    source: str
    process: ClientProcess | None = None
    problem: str = ""


class LocalCameras:
    """Starts the clients, restarts them when they end, and stops them. Methods may be called from any thread."""

    def __init__(self, stage: LiveStage, token: str, certificate: Path | None = None) -> None:
        """`token`: the clients', if the studio requires one; `certificate`: the server's own, if it has one."""
        self._stage = stage
        self._token = token
        self._spool, self._certificate = stage.sessions / SPOOL, certificate
        self._lock = threading.RLock()
        self._clients: dict[str, _Client] = {}
        self._opened: str | None = None
        self._performers = 1
        self._url = ""
        self._stopped = threading.Event()
        self._thread: threading.Thread | None = None

    def start_simulated(
        self,
        url: str,
        sources: dict[str, str],
        performers: int = 1,
        running: Mapping[str, ClientProcess] | None = None,
    ) -> None:
        """Start the simulated stage, and calibrate it if there is no calibration yet.

        Args:
            url: the server's.
            sources: of `simulated_sources`.
            performers: how many are on the stage.
            running: clients that were started before, by the camera's name.
        """
        self.start(sources, SIMULATED, url, running=running)
        self._performers = performers

    def start(
        self,
        sources: dict[str, str],
        opened: str,
        url: str,
        calibration: Calibration | None = None,
        *,
        running: Mapping[str, ClientProcess] | None = None,
    ) -> None:
        """Start clients in place of the running ones.

        Args:
            sources: arguments of `studio camera --source`, by the camera's name.
            opened: their description, for `status`.
            url: the server's.
            calibration: of a recording; in use during its playback.
            running: clients of these sources that were started before, by the camera's name.

        Raises:
            StudioError: another camera with one of the names is connected.
        """
        with self._lock:
            refuse_taken(self._stage, sources.keys() - self._clients.keys())
            self._end_clients()
            self._stage.borrow_calibration(calibration)
            started = running or {}
            self._clients = {name: _Client(source, started.get(name)) for name, source in sources.items()}
            self._opened, self._url, self._performers = opened, url, 1
            self._stopped.clear()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="local cameras", daemon=True)
                self._thread.start()

    def status(self) -> LocalCamerasStatus:
        """Return what is open, and the state of its clients."""
        with self._lock:
            cameras = {
                name: LocalClientStatus(
                    client.process is not None and client.process.is_running, client.problem
                )
                for name, client in self._clients.items()
            }
            return LocalCamerasStatus(self._opened, cameras, self._performers)

    def stop(self) -> None:
        """Stop all clients; a recording's calibration is no longer used."""
        with self._lock:
            self._end_clients()
            self._stage.borrow_calibration(None)

    def end(self) -> None:
        """Ask the clients to stop; does not wait."""
        self._stopped.set()
        for client in list(self._clients.values()):
            if client.process is not None:
                client.process.ask_to_end()

    def close(self) -> None:
        """Stop the clients and the thread that watches them."""
        self._stopped.set()
        if self._thread is not None:
            self._thread.join()
        with self._lock:
            self._end_clients()

    def _end_clients(self) -> None:
        processes = [client.process for client in self._clients.values() if client.process is not None]
        self._clients, self._opened = {}, None
        for process in processes:
            process.ask_to_end()
        for process in processes:
            process.end()

    def _run(self) -> None:
        pause_s, calibrates = CHECK_S, CalibratesOnce(self._stage)
        while not self._stopped.is_set():
            with self._lock:
                ended = [name for name in list(self._clients) if self._start_missing(name)]
                simulated = self._opened == SIMULATED
                names = list(self._clients)
            pause_s = min(2 * pause_s, SLOWEST_RESTART_S) if ended else CHECK_S
            if simulated:
                calibrates.try_now(names)
            self._stopped.wait(pause_s)

    def _start_missing(self, name: str) -> bool:
        """Start a client that is not running; return whether it had ended."""
        client = self._clients[name]
        ended = client.process is not None
        if client.process is not None:
            if client.process.is_running:
                return False
            client.problem = client.process.last_words()
            _log.warning("%s ended with code %s and is started again", name, client.process.code)
        client.process = ClientProcess(
            name,
            client.source,
            url=self._url,
            token=self._token,
            folder=self._spool,
            certificate=self._certificate,
        )
        return ended

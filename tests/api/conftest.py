"""A real server on a free port, with a live stage, for clients over real sockets."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from studio.api.access import Access
from studio.api.app import create_app
from studio.live import LiveStage
from studio.server.listening import open_socket
from studio.server.run import Server, make_server
from tests import patient
from tests.api.camera import Camera, send_frames, wait_until
from tests.live.performer import save_stage_calibration


@pytest.fixture(scope="session", autouse=True)
def works_quickly(ready_worker: None, ready_pipeline: None) -> None:
    """A worker process is ready for the server, and so is this process for pipelines."""


@dataclass
class Studio:
    """A running server: its live stage, its folder, its address, a client for its routes."""

    stage: LiveStage
    sessions: Path
    port: int
    http: httpx.Client

    def url(self, path: str) -> str:
        """Address of a WebSocket."""
        return f"ws://127.0.0.1:{self.port}/api/v1/{path}"


class _Running:
    def __init__(self, sessions: Path, **options: float) -> None:
        listening = open_socket("127.0.0.1", 0)
        port = listening.getsockname()[1]
        self._stage = LiveStage(sessions)
        self._stage.start()
        self._server: Server = make_server(create_app(self._stage, sessions, **options))
        self._socket = listening
        self._thread = threading.Thread(target=self._server.run, args=([listening],))
        self._thread.start()
        http = patient.Client(base_url=f"http://127.0.0.1:{port}/api/v1", timeout=60.0)
        self.studio = Studio(self._stage, sessions, port, http)

    def close(self) -> None:
        self.studio.http.close()
        self._server.should_exit = True
        self._thread.join()
        self._stage.close()
        self._socket.close()


@pytest.fixture
def start_studio() -> Iterator[Callable[..., Studio]]:
    """A function that starts a server on a folder of sessions; all are closed at the end."""
    running: list[_Running] = []

    def start(sessions: Path, **options: float) -> Studio:
        running.append(_Running(sessions, **options))
        return running[-1].studio

    yield start
    for each in running:
        each.close()


@pytest.fixture
def studio(start_studio, tmp_path):
    """A studio without takes."""
    return start_studio(tmp_path / "sessions")


@pytest.fixture
def clock() -> list[float]:
    """What the clock of `access` shows [s], as the one element."""
    return [0.0]


@pytest.fixture
def access(tmp_path: Path, clock: list[float]) -> Access:
    """Tokens of a studio that asks for them."""
    return Access(tmp_path / "sessions", required=True, now_s=lambda: clock[0])


@pytest.fixture
def open_studio(start_studio: Callable[..., Studio], tmp_path: Path, access: Access) -> Studio:
    """A studio that is open to the network and asks for tokens."""
    return start_studio(tmp_path / "sessions", access=access)


@pytest.fixture
def recorded(start_studio, tmp_path):
    """A studio with the recorded take tests/one."""
    save_stage_calibration(tmp_path / "sessions", ["camera_0"])
    studio = start_studio(tmp_path / "sessions")
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.exchange_clocks()
        studio.http.post("/record/start", json={"session": "tests", "take": "one"}).raise_for_status()
        seen = studio.stage.results.get()[0]
        wait_until(
            lambda: (send_frames([camera], 1), studio.stage.results.get()[0] > seen + 20)[1], "poses come"
        )
        studio.http.post("/record/stop").raise_for_status()
    return studio

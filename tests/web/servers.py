"""A whole studio with its page in a thread of the tests.

It answers as `studio serve` does. A process of its own would load all modules anew, which takes seconds.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from studio.api.access import Access
from studio.api.app import create_app
from studio.api.takes.find import Finder
from studio.engine.base.errors import TakeError
from studio.live import LiveStage
from studio.server.listening import open_socket
from studio.server.run import make_server
from studio.web import mount
from tests import patient
from tests.acceptance.processes import free_port
from tests.web.stages import until


class ThreadServer:
    """A studio on a folder of sessions; `signed_in`: it asks operators for a token."""

    def __init__(self, sessions: Path, *, signed_in: bool = False) -> None:
        self.sessions = sessions
        self.port = free_port()
        self.http = patient.Client(base_url=f"{self.url}/api/v1")
        self._signed_in = signed_in
        self._thread: threading.Thread | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it, and wait until it answers."""
        self._stage = LiveStage(self.sessions)
        self._stage.start()
        self._access = Access(self.sessions, required=self._signed_in, now_s=time.monotonic)
        self._app = app = create_app(self._stage, self.sessions, access=self._access, discover=False)
        takes = Finder(self._stage, self.sessions)
        self._view = mount(app, self._stage, sessions=self.sessions, takes=takes, jobs=app.state.jobs)
        self._server = make_server(app)
        self._socket = open_socket("127.0.0.1", self.port)
        self._thread = threading.Thread(target=self._server.run, args=([self._socket],))
        self._thread.start()
        until(lambda: self._server.started)

    def operator_token(self) -> str:
        """What an operator signs in with."""
        return self._access.operator_token

    def close(self) -> None:
        """End it in order, if it runs."""
        self.http.close()
        if self._thread is None:
            return
        self._server.should_exit = True
        self._thread.join()
        self._thread = None
        self._socket.close()
        state = self._app.state
        self._end_works()
        for each in (state.local_cameras, state.devices, state.announced, state.triggers):
            each.close()
        self._stage.close()
        state.outputs.close()
        self._view.close()

    def _end_works(self) -> None:
        """Cancel all work, the newest first, which would go on beside other tests."""
        jobs = self._app.state.jobs
        for job in reversed(jobs.list()):
            with suppress(TakeError):  # it is at its last step
                jobs.cancel(job.id)
        until(lambda: all(job.ended for job in jobs.list()))

    def record(self, name: str) -> None:
        """Begin a take."""
        self.http.post("/record/start", json={"session": "tests", "take": name}).raise_for_status()

    def stop(self) -> dict[str, Any]:
        return self.http.post("/record/stop").raise_for_status().json()


@contextmanager
def thread_server(sessions: Path, *, signed_in: bool = False) -> Iterator[ThreadServer]:
    """A studio that is running."""
    sessions.mkdir(parents=True, exist_ok=True)
    server = ThreadServer(sessions, signed_in=signed_in)
    try:
        server.start()
        yield server
    finally:
        server.close()

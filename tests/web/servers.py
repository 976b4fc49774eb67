"""A whole studio with its page in a thread of the tests.

It answers as `studio serve` does. A process of its own would load all modules anew, which takes seconds.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studio.api.access import Access
from studio.api.jobs import Jobs
from studio.engine.base.errors import TakeError
from tests import patient
from tests.web.stages import serving, until
from tests.web.test_page import studio


@dataclass(frozen=True)
class ThreadServer:
    """A studio that runs on a folder of sessions: its address, its API, and who may use it."""

    sessions: Path
    url: str
    http: patient.Client
    access: Access

    def operator_token(self) -> str:
        """What an operator signs in with."""
        return self.access.operator_token

    def record(self, name: str) -> None:
        """Begin a take."""
        self.http.post("/record/start", json={"session": "tests", "take": name}).raise_for_status()

    def stop(self) -> dict[str, Any]:
        return self.http.post("/record/stop").raise_for_status().json()


@contextmanager
def thread_server(sessions: Path, *, signed_in: bool = False) -> Iterator[ThreadServer]:
    """A studio while the block runs; `signed_in`: it asks operators for a token."""
    sessions.mkdir(parents=True, exist_ok=True)
    access = Access(sessions, required=signed_in, now_s=time.monotonic)
    with (
        studio(sessions, access) as (app, _),
        serving(app) as url,
        patient.Client(base_url=f"{url}/api/v1") as http,
    ):
        try:
            yield ThreadServer(sessions, url, http, access)
        finally:
            end_works(app.state.jobs)


def end_works(jobs: Jobs) -> None:
    """Cancel all work, the newest first, which would go on beside other tests."""
    for job in reversed(jobs.list()):
        with suppress(TakeError):  # it is at its last step
            jobs.cancel(job.id)
    until(lambda: all(job.ended for job in jobs.list()))

"""Long work, one after the other in processes of their own: solves and whatever else takes seconds."""

import itertools
import logging
import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from studio.api.errors import NotFoundError
from studio.engine.errors import StudioError
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

KEPT = 50
"""Jobs that are remembered."""


@dataclass
class Job:
    """A job: `state` is waiting, running, done or failed; `progress` 0..1; `message` says why it failed."""

    id: str
    kind: str
    take: str
    name: str
    state: str = "waiting"
    progress: float = 0.0
    message: str = ""


class Jobs:
    """Runs jobs one at a time, since the live stage needs the other cores."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()
        self._turn = threading.Lock()
        self._numbers = itertools.count(1)

    def submit(
        self, kind: str, take: str, name: str, function: Callable[..., Any], *args: Any, **kwargs: Any
    ) -> Job:
        """Begin `function(*args, progress=..., **kwargs)`, of a module's top level, and return the job."""
        with self._lock:
            job = Job(str(next(self._numbers)), kind, take, name)
            self._jobs[job.id] = job
            while len(self._jobs) > KEPT:
                del self._jobs[next(iter(self._jobs))]
        thread = threading.Thread(
            target=self._run, args=(job, function, args, kwargs), name=f"job {job.id}", daemon=True
        )
        thread.start()
        return job

    def _run(self, job: Job, function: Callable[..., Any], args: Any, kwargs: dict[str, Any]) -> None:
        def progress(share: float) -> None:
            job.progress = round(share, 3)

        with self._turn:
            job.state = "running"
            try:
                run_in_process(function, *args, on_progress=progress, **kwargs)
            except StudioError as error:
                job.state, job.message = "failed", str(error)
            except Exception as error:  # the boundary of the thread
                _log.exception("job %s failed", job.id)
                job.state, job.message = "failed", f"{error!r}; the server's log has the details"
            else:
                job.state, job.progress = "done", 1.0

    def get(self, job_id: str) -> dict[str, Any]:
        """Return a job as JSON.

        Raises:
            NotFoundError: no such job.
        """
        job = self._jobs.get(job_id)
        if job is None:
            raise NotFoundError(f"there is no job {job_id!r}; GET /api/v1/jobs lists them")
        return asdict(job)

    def list(self) -> "list[dict[str, Any]]":
        """Return all jobs that are remembered, the oldest first."""
        with self._lock:
            return [asdict(job) for job in self._jobs.values()]

"""Long work, one after the other in processes of their own: solves and whatever else takes seconds."""

import itertools
import logging
import queue
import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from studio.api.errors import NotFoundError
from studio.engine.errors import StudioError
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

Work = Callable[[Callable[[float], None]], Any]
"""A job's work, which is given the function to tell its progress to."""

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
    """Runs jobs one after the other, since the live stage needs the other cores."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._queue: queue.SimpleQueue[tuple[Job, Work]] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def submit(
        self, kind: str, take: str, name: str, function: Callable[..., Any], *args: Any, **kwargs: Any
    ) -> Job:
        """Begin `function(*args, progress=..., **kwargs)`, of a module's top level, in a process of its own; return
        the job."""
        return self._add(
            Job(str(next(self._numbers)), kind, take, name),
            lambda progress: run_in_process(function, *args, on_progress=progress, **kwargs),
        )

    def call(self, kind: str, take: str, name: str, function: Callable[[], Any]) -> Job:
        """Have `function()` called in this process once the jobs before it have ended, and return the job."""
        return self._add(Job(str(next(self._numbers)), kind, take, name), lambda _: function())

    def _add(self, job: Job, work: Work) -> Job:
        with self._lock:
            self._jobs[job.id] = job
            while len(self._jobs) > KEPT:
                del self._jobs[next(iter(self._jobs))]
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="jobs", daemon=True)
                self._thread.start()
        self._queue.put((job, work))
        return job

    def _run(self) -> None:
        while True:
            job, work = self._queue.get()

            def progress(share: float, job: Job = job) -> None:
                job.progress = round(share, 3)

            job.state = "running"
            try:
                work(progress)
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

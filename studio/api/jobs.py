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
from studio.worker import Stopped, run_in_process

_log = logging.getLogger(__name__)

Work = Callable[[Callable[[float], None]], Any]
"""A job's work, which is given the function to tell its progress to."""

REPLACED = "replaced"
_UNDER_WAY = ("waiting", "running")

KEPT = 50
"""Jobs that are remembered."""


@dataclass
class Job:
    """A job: `state` is waiting, running, done, failed or replaced (a newer one makes the same); `progress` 0..1;
    `message` says why it failed."""

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
        self._listeners: set[Callable[[], None]] = set()

    def submit(
        self,
        kind: str,
        take: str,
        name: str,
        function: Callable[..., Any],
        *args: Any,
        then: Callable[[Any], None] = lambda value: None,
        **kwargs: Any,
    ) -> Job:
        """Begin `function(*args, progress=..., **kwargs)`, of a module's top level, in a process of its own; return
        the job. `then` is called in this process with what it returned, before the job is done."""
        job = Job(str(next(self._numbers)), kind, take, name)

        def work(progress: Callable[[float], None]) -> None:
            value = run_in_process(
                function, *args, on_progress=progress, should_stop=lambda: job.state == REPLACED, **kwargs
            )
            then(value)

        return self._add(job, work)

    def replace(self, kinds: tuple[str, ...], take: str, name: str) -> None:
        """Stop jobs of these kinds that would make the same as a job that is about to be submitted."""
        with self._lock:
            for job in self._jobs.values():
                if (job.take, job.name) == (take, name) and job.kind in kinds and job.state in _UNDER_WAY:
                    job.state = REPLACED

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` whenever a job has ended, from any thread; return a function that ends this."""
        self._listeners.add(listener)
        return lambda: self._listeners.discard(listener)

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

            with self._lock:
                if job.state == REPLACED:
                    continue
                job.state = "running"
            self._do(job, lambda work=work, progress=progress: work(progress))
            for listener in tuple(self._listeners):
                listener()

    def _do(self, job: Job, work: Callable[[], Any]) -> None:
        """Do a job's work, and note how it ended."""
        state, message = "done", ""
        try:
            work()
        except Stopped:
            state = REPLACED
        except StudioError as error:
            state, message = "failed", str(error)
        except Exception as error:  # the boundary of the thread
            _log.exception("job %s failed", job.id)
            state, message = "failed", f"{error!r}; the server's log has the details"
        with self._lock:
            if job.state != REPLACED:
                job.state, job.message = state, message
                job.progress = 1.0 if state == "done" else job.progress

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

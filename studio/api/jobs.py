"""Long work in separate processes: solves, exports, imports and everything else that takes seconds; its list."""

import itertools
import logging
import queue
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from msgspec import Struct

from studio.api.errors import NotFoundError
from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.sentences import say
from studio.worker import Stopped, run_in_process

_log = logging.getLogger(__name__)

Work = Callable[[Callable[[float], None]], Any]
"""A job's work; its argument receives the progress."""

REPLACED, CANCELLING, CANCELLED = "replaced", "cancelling", "cancelled"
UNDER_WAY = ("waiting", "running", CANCELLING)

COMPUTING, FILES = "computing", "files"
"""Two lanes, each with one job at a time, so that imports and uploads do not wait for solves."""

KEPT = 50
"""Number of ended jobs kept in the list."""

KEPT_S = 3600.0
"""Time for which an ended job is listed."""

_TOLD_S = 1.0
_TOLD_SHARE = 0.01
"""Share done from which the time left is estimated."""


class JobStatus(Struct):
    """A job and its state.

    Attributes:
        id, kind, take, name: its number, its kind, the take's id (session/name), and the name of its result.
        state: waiting, running, cancelling, done, failed, cancelled, or replaced (by a newer one with the same
            result).
        progress: 0..1.
        step: the present one of several steps, such as `upload`; empty with only one.
        message: why it failed.
        ended: when it ended, ISO 8601 in UTC; empty before.
        can_cancel: whether it can be cancelled once it runs.
        seconds, left_s: running time, and approximate time left [s]; None where unknown.
        so_far_s, of_s: of a solve in progress, the length that can be replayed and the final length [s]; None where
            nothing can be replayed yet.
    """

    id: str
    kind: str
    take: str
    name: str
    state: str = "waiting"
    progress: float = 0.0
    step: str = ""
    message: str = ""
    ended: str = ""
    can_cancel: bool = True
    seconds: int | None = None
    left_s: int | None = None
    so_far_s: float | None = None
    of_s: float | None = None


class Job(JobStatus):
    """A job while it is listed; `began_s` and `ended_s` are on this process's clock [s]."""

    began_s: float | None = None
    ended_s: float | None = None

    def tell(self, share: float) -> None:
        """Set the share done, 0..1."""
        self.progress = round(share, 3)

    def begin(self, step: str = "") -> None:
        """Start the job, or its next step."""
        self.state, self.step, self.progress, self.began_s = "running", step, 0.0, time.monotonic()

    def end(self, state: str, message: str = "") -> None:
        """Set the job's final state and the time."""
        self.state, self.message = state, message
        self.progress = 1.0 if state == "done" else self.progress
        self.ended_s, self.ended = time.monotonic(), datetime.now(UTC).isoformat(timespec="seconds")

    def status(self) -> JobStatus:
        """Return its present state."""
        seconds = None if self.began_s is None else (self.ended_s or time.monotonic()) - self.began_s
        left_s = None
        if self.state == "running" and seconds is not None:
            if seconds >= _TOLD_S and self.progress >= _TOLD_SHARE:
                left_s = round(seconds * (1.0 - self.progress) / self.progress)
        values = {name: getattr(self, name) for name in JobStatus.__struct_fields__}
        values |= {"seconds": None if seconds is None else round(seconds), "left_s": left_s}
        return JobStatus(**values)


class Jobs:
    """Runs one job at a time in each lane, because the live stage needs the other cores."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._lanes: dict[str, queue.SimpleQueue[tuple[Job, Work, str]]] = {}
        self._listeners: set[Callable[[], object]] = set()
        self._clearing: dict[str, Callable[[], object]] = {}

    def submit(
        self,
        kind: str,
        take: str,
        name: str,
        function: str,
        /,
        *args: Any,
        then: Callable[[Any], None] = lambda value: None,
        **kwargs: Any,
    ) -> Job:
        """Start `function(*args, progress=..., **kwargs)`, named as for `run_in_process`, in a separate process;
        return the job. `then` is called in this process with the result, before the job is done.
        """
        return self.submit_listed(self.list_new(kind, take, name), function, *args, then=then, **kwargs)

    def submit_listed(
        self,
        job: Job,
        function: str,
        /,
        *args: Any,
        then: Callable[[Any], None] = lambda value: None,
        part: Callable[[Any], None] | None = None,
        clear: Callable[[], object] | None = None,
        **kwargs: Any,
    ) -> Job:
        """Start the work of a listed job as `submit` does, and return the job.

        In this process `part` is called with parts of the result that are ready (`on_part` of `run_in_process`), and
        `clear` in any case, before the job has ended.
        """

        def work(progress: Callable[[float], None]) -> None:
            value = run_in_process(
                function,
                *args,
                on_progress=progress,
                on_part=part,
                should_stop=lambda: is_stopped(job),
                **kwargs,
            )
            then(value)

        return self.run(job, work, clear=clear)

    def call(self, kind: str, take: str, name: str, function: Callable[[], Any]) -> Job:
        """Call `function()` in this process once the earlier jobs have ended, and return the job."""
        job = self.list_new(kind, take, name)
        job.can_cancel = False
        return self.run(job, lambda _: function())

    def list_new(self, kind: str, take: str, name: str) -> Job:
        """Return a new waiting job; the caller must run or end it."""
        job = Job(str(next(self._numbers)), kind, take, name)
        with self._lock:
            self._jobs[job.id] = job
        self._forget_old()
        return job

    def run(
        self,
        job: Job,
        work: Work,
        lane: str = COMPUTING,
        step: str = "",
        clear: Callable[[], object] | None = None,
    ) -> Job:
        """Have a listed job's work done in its turn, and return the job.

        Args:
            job: one that waits, or that is at an earlier step.
            work: what is done.
            lane: the queue in which it waits.
            step: the step of the job that this work is.
            clear: called when it is over or will not be done, before the job has ended.
        """
        with self._lock:
            if job.state == "running":
                job.state = "waiting"
            if clear is not None:
                self._clearing[job.id] = clear
            if lane not in self._lanes:
                self._lanes[lane] = queue.SimpleQueue()
                threading.Thread(target=self._run, args=(lane,), name=f"jobs {lane}", daemon=True).start()
        self._lanes[lane].put((job, work, step))
        return job

    def replace(self, kinds: tuple[str, ...], take: str, name: str) -> None:
        """Stop jobs of these kinds that have the same result as a job about to be submitted."""
        with self._lock:
            for job in self._jobs.values():
                if (job.take, job.name) == (take, name) and job.kind in kinds and job.state in UNDER_WAY:
                    job.end(REPLACED)

    def cancel(self, job_id: str) -> JobStatus:
        """Cancel a job that waits or runs, and return it; one that has ended stays as it is.

        Raises:
            NotFoundError: no such job.
            TakeError: its present step cannot be cancelled.
        """
        job = self._find(job_id)
        with self._lock:
            waits = job.state == "waiting"
            if waits:
                job.state = CANCELLING
            elif job.state == "running" and not job.can_cancel:
                raise TakeError(
                    "job.last_step",
                    "{kind} {name} is at its last step and cannot be cancelled; wait for it",
                    kind=job.kind,
                    name=job.name,
                )
            elif job.state == "running":
                job.state = CANCELLING
        if waits:
            self._clear_up(job)
            job.end(CANCELLED)
        self.tell_listeners()
        return job.status()

    def clear(self) -> int:
        """Remove the ended jobs from the list; return their number."""
        with self._lock:
            gone = [job.id for job in self._jobs.values() if job.state not in UNDER_WAY]
            for job_id in gone:
                del self._jobs[job_id]
        self.tell_listeners()
        return len(gone)

    def listen(self, listener: Callable[[], object]) -> Callable[[], None]:
        """Call `listener` whenever a job has ended, from any thread; return a function that ends the subscription."""
        self._listeners.add(listener)
        return lambda: self._listeners.discard(listener)

    def tell_listeners(self) -> None:
        """Call the listeners."""
        for listener in tuple(self._listeners):
            listener()

    def _forget_old(self) -> None:
        """Remove jobs that ended long ago from the list, and the oldest if there are too many."""
        with self._lock:
            ended = [job for job in self._jobs.values() if job.ended_s is not None]
            now_s = time.monotonic()
            for n, job in enumerate(reversed(ended)):
                if n >= KEPT or now_s - (job.ended_s or now_s) > KEPT_S:
                    del self._jobs[job.id]

    def _run(self, lane: str) -> None:
        while True:
            job, work, step = self._lanes[lane].get()
            with self._lock:
                begins = job.state == "waiting"
                if begins:
                    job.begin(step)
            if not begins:
                self._clear_up(job)
                if job.state == CANCELLING:
                    job.end(CANCELLED)
                continue
            self._do(job, lambda work=work, job=job: work(job.tell))
            self.tell_listeners()

    def _do(self, job: Job, work: Callable[[], Any]) -> None:
        """Do a job's work, and store its result."""
        state, message = "done", ""
        try:
            work()
        except Stopped:
            state = CANCELLED
        except StudioError as error:
            state, message = "failed", error.sentence
        except Exception as error:  # boundary of the thread
            _log.exception("job %s failed", job.id)
            state, message = (
                "failed",
                say("server.details", "{error!r}; the server's log has the details", error=error),
            )
        self._clear_up(job)
        with self._lock:
            if job.state != REPLACED:
                job.end(state, message)

    def _clear_up(self, job: Job) -> None:
        """Call the `clear` of a job whose work is over or will not be done."""
        with self._lock:
            clear = self._clearing.pop(job.id, None)
        if clear is not None:
            clear()

    def _find(self, job_id: str) -> Job:
        job = self._jobs.get(job_id)
        if job is None:
            raise NotFoundError("job.none", "there is no job {id!r}; GET /api/v1/jobs lists them", id=job_id)
        return job

    def get(self, job_id: str) -> JobStatus:
        """Return a job as it is now.

        Raises:
            NotFoundError: no such job.
        """
        return self._find(job_id).status()

    def list(self) -> "list[JobStatus]":
        """Return all jobs that are listed, the oldest first."""
        self._forget_old()
        with self._lock:
            return [job.status() for job in self._jobs.values()]


def is_stopped(job: Job) -> bool:
    """Whether a running job should stop."""
    return job.state in (REPLACED, CANCELLING)

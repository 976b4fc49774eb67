"""Routes of imports: files of the browser's machine become takes or robots, each import a job of the list of work."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Request
from msgspec import Struct
from pydantic import Field
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.jobs import CANCELLED, FILES, Job, Jobs, JobStatus, is_stopped
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.sentences import say
from studio.engine.robots.files import FOLDER as ROBOTS
from studio.take.library.dropped import Group, group_files
from studio.take.library.incoming import Incoming, check_room, clear_left, free_path
from studio.take.video.sync.clap_at import read_clap_at
from studio.take.video.sync.find import WAYS, check_way
from studio.worker import Stopped, run_in_process

MAX_FILES = 50_000
SILENT_S = 60.0
"""Silence after which a browser is assumed to be gone [s]."""

GONE = say("import.browser_gone", "the browser went before all files were sent; send them again")

_LOOK_S = 0.25
_PIECE_BYTES = 1 << 20


class FileRequest(Body):
    """A file that will be sent."""

    path: Annotated[str, Field(max_length=3000, examples=["walk/camera_0/joints.csv"])]
    size: Annotated[int, Field(ge=0, description="[bytes]")]


class ImportRequest(Body):
    """Files that were given together."""

    files: list[FileRequest] = Field(min_length=1, max_length=MAX_FILES)
    sync: Annotated[
        str | None,
        Field(description="brings videos to one clock: " + ", ".join(WAYS) + "; null = auto"),
    ] = None
    clap_at: Annotated[
        list[Annotated[str, Field(max_length=200)]],
        Field(
            default_factory=list,
            max_length=100,
            description="about when the clap is heard [s], in all videos or in one",
            examples=[["3.5", "left=4"]],
        ),
    ]


class AnnouncedImport(Struct):
    """An import that waits for its files: its job, the indices of its files in the announced list, and whether they
    are of robots; the job's `name` then becomes the robots' names once it is done."""

    job: JobStatus
    files: list[int]
    robot: bool = False


@dataclass
class _Awaited:
    """An import whose files have not been sent yet."""

    job: Job
    group: Group
    files: list[tuple[str, int]]
    sync: str | None
    clap_at_s: dict[str, float]
    batch: "_Batch"


@dataclass
class _Batch:
    """Imports that were announced together; they are sent one after the other."""

    heard_s: float


class Imports:
    """Receives files and has them imported."""

    def __init__(self, sessions: Path, jobs: Jobs) -> None:
        self._sessions, self._jobs = sessions, jobs
        self._awaited: dict[str, _Awaited] = {}
        self._lock = threading.Lock()
        self._watching = False
        clear_left(sessions)

    def announce(
        self, files: list[tuple[str, int]], sync: str | None = None, clap_at: Sequence[str] = ()
    ) -> list[AnnouncedImport]:
        """List the imports that files will make; return each with its job and its files' indices.

        Args:
            files: path and size [bytes] of each.
            sync: brings videos to one clock, see `find_sync`.
            clap_at: when a clap is heard, see `read_clap_at`.

        Raises:
            SettingsError: an unknown `sync`, or a `clap_at` that is no time.
        """
        clap_at_s = read_clap_at(clap_at)
        if sync is not None:
            check_way(sync)
        batch = _Batch(time.monotonic())
        answer: list[AnnouncedImport] = []
        for group in group_files([path for path, _ in files]):
            job = self._jobs.list_new("import", "", group.label)
            mine = [files[index] for index in group.files]
            try:
                if group.problem:
                    raise FormatError(group.problem)
                check_room(self._sessions, sum(size for _, size in mine))
                with self._lock:
                    self._awaited[job.id] = _Awaited(job, group, mine, sync, clap_at_s, batch)
            except StudioError as error:
                job.end("failed", error.sentence)
            answer.append(AnnouncedImport(job.status(), list(group.files), group.robot))
        self._jobs.tell_listeners()
        if not self._watching:
            self._watch()
        return answer

    async def receive(self, job_id: str, request: Request) -> JobStatus:
        """Receive the files of an import, and have them imported; return its job."""
        with self._lock:
            awaited = self._awaited.pop(job_id, None)
        if awaited is None or awaited.job.state != "waiting":
            raise NotFoundError(
                "import.none_waits",
                "no import {id!r} waits for files; POST /api/v1/imports announces one",
                id=job_id,
            )
        job, incoming = awaited.job, None
        job.begin("upload")
        state, problem = CANCELLED, None
        try:
            incoming = await run_in_threadpool(Incoming, self._sessions, awaited.files)
            await self._take_in(awaited, incoming, request)
            state = ""
        except ClientDisconnect:
            state, problem = "failed", FormatError(GONE)
        except Stopped:
            pass
        except StudioError as error:
            state, problem = "failed", error
        finally:
            if state and incoming is not None:
                incoming.discard()
            if state:
                job.end(state, "" if problem is None else problem.sentence)
                self._jobs.tell_listeners()
        if problem is not None:
            raise problem
        if incoming is not None and not state:
            self._read(awaited, incoming)
        return job.status()

    async def _take_in(self, awaited: _Awaited, incoming: Incoming, request: Request) -> None:
        async for piece in _pieces(request, awaited.job):
            await run_in_threadpool(incoming.write, piece)
            awaited.batch.heard_s = time.monotonic()
            awaited.job.tell(incoming.received / max(incoming.total, 1))
        incoming.end()

    def _read(self, awaited: _Awaited, incoming: Incoming) -> None:
        """Have the received files imported in their turn."""
        job, group = awaited.job, awaited.group

        def read_robots(progress: Any) -> None:
            names = run_in_process(
                "studio.take.library.incoming_robot:import_robots",
                incoming.folder, group.root, group.label, self._sessions / ROBOTS,
                on_progress=progress, should_stop=lambda: is_stopped(job),
            )  # fmt: skip
            job.name = ", ".join(names)

        def work(progress: Any) -> None:
            session = datetime.now().astimezone().strftime("%Y-%m-%d")
            out = free_path(self._sessions, session, group.label)
            job.take = f"{session}/{out.name}"
            try:
                run_in_process(
                    "studio.take.library.incoming:import_incoming",
                    incoming.folder, group.root, group.label, out, awaited.sync,
                    awaited.clap_at_s,
                    on_progress=progress, should_stop=lambda: is_stopped(job),
                )  # fmt: skip
            except StudioError:
                job.take = ""
                raise

        self._jobs.run(job, read_robots if group.robot else work, FILES, "read", incoming.discard)

    def _watch(self) -> None:
        """Give up imports that are no longer being sent, now and from time to time."""
        with self._lock:
            for job_id, awaited in list(self._awaited.items()):
                if time.monotonic() - awaited.batch.heard_s > SILENT_S:
                    awaited.job.end("failed", GONE)
                if awaited.job.state != "waiting":
                    del self._awaited[job_id]
            self._watching = bool(self._awaited)
            if not self._watching:
                return
        timer = threading.Timer(SILENT_S / 4, self._watch)
        timer.daemon = True
        timer.start()


async def _pieces(request: Request, job: Job) -> AsyncIterator[bytes]:
    """Yield the request's body in pieces of about a megabyte.

    Raises:
        Stopped: the job is to stop. ClientDisconnect: the browser has gone, or is silent.
    """
    stream = request.stream()
    kept = bytearray()
    while True:
        coming = asyncio.ensure_future(anext(stream, None))
        silent_s = 0.0
        while not (await asyncio.wait({coming}, timeout=_LOOK_S))[0]:
            silent_s += _LOOK_S
            if is_stopped(job) or silent_s >= SILENT_S:
                coming.cancel()
                raise Stopped("import.cancelled", "cancelled") if is_stopped(job) else ClientDisconnect
        piece = coming.result()
        if is_stopped(job):
            raise Stopped("import.cancelled", "cancelled")
        kept += piece or b""
        if kept and (piece is None or len(kept) >= _PIECE_BYTES):
            yield bytes(kept)
            kept.clear()
        if piece is None:
            return


def imports_router(sessions: Path, jobs: Jobs) -> APIRouter:
    """Return the routes of imports into `sessions`."""
    router = APIRouter(prefix="/api/v1/imports", tags=["takes"], responses=RESPONSES, route_class=StructRoute)
    imports = Imports(sessions, jobs)

    @router.post("", status_code=202)
    def announce(request: ImportRequest) -> dict[str, list[AnnouncedImport]]:
        """Announce files; answers the `imports` that they make, one per take or folder of robots: the `job`, and the
        indices in the list of the `files` whose bytes `PUT /imports/{job}` takes. Files that cannot be imported by
        their names fail at once."""
        files = [(file.path, file.size) for file in request.files]
        return {"imports": imports.announce(files, request.sync, request.clap_at)}

    @router.put("/{job_id}", status_code=202)
    async def send(job_id: str, request: Request) -> JobStatus:
        """Send an import's files, one after the other without separators; answers its job."""
        return await imports.receive(job_id, request)

    return router

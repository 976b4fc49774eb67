"""Routes that manage takes: their slate, the trash, and takes as one file."""

import tempfile
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Request
from fastapi.responses import FileResponse
from msgspec import Struct
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from studio.api.errors import RESPONSES
from studio.api.jobs import Jobs, JobStatus
from studio.api.lenses import LENSES, SAME_LENS, LensRequest, known_lenses
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder, ListedTake
from studio.engine.base.errors import FormatError
from studio.engine.model.calibration import CalibrationJson
from studio.engine.model.performers.exchange import Exchange
from studio.take.folder.names import inside
from studio.take.folder.take import Take, check_free
from studio.take.library.borrow import borrow_calibration, use_calibration
from studio.take.library.bundle import ENDING, MAX_BYTES
from studio.take.library.sessions import take_info, take_path
from studio.take.library.slate import Slate, TimelineMarker, change_slate
from studio.take.library.trash import (
    Thrown,
    empty_trash,
    list_trash,
    restore,
    throw_away,
    throw_solve_away,
    throw_video_away,
)
from studio.worker import run_in_process


class MarkerRequest(Body):
    """A named instant of a take."""

    time_s: float = Field(description="stage time [s]")
    name: str = Field(examples=["kick"])


class TakeExchangeRequest(Body):
    """Two performers who are exchanged from a moment on."""

    time_s: float = Field(description="stage time [s]")
    performers: tuple[str, str] = Field(examples=[["performer_1", "performer_2"]])


class SlateRequest(Body):
    """Changes to a take; missing fields stay."""

    session: str | None = Field(None, examples=["monday"])
    name: str | None = Field(None, examples=["jump_best"])
    performer: str | None = None
    notes: str | None = None
    tags: tuple[str, ...] | None = Field(None, examples=[["best", "fight"]])
    markers: tuple[MarkerRequest, ...] | None = Field(None, description="all of them; those left out go")
    performer_names: dict[str, str] | None = Field(
        None, description="of all performers; those left out lose theirs", examples=[{"performer_1": "Ana"}]
    )
    exchanges: tuple[TakeExchangeRequest, ...] | None = Field(
        None,
        description="all of them, in the order in which they are made; solve the take again to have them",
    )
    rating: Annotated[int | None, Field(ge=0, le=5, description="0: none")] = None
    starred: bool | None = None


class CalibrateRequest(Body):
    """Calibrate from the take's own frames, or borrow from another take."""

    borrow: str | None = Field(
        default=None, description="a take's id, session/name", examples=["monday/take_001"]
    )
    reference: str | None = Field(
        default=None, description="camera whose clock is the stage clock; else the first"
    )
    height_m: float | None = Field(
        default=None,
        description="the performer's height without shoes [m]; where no camera sees depth, it gives the stage's size",
    )
    lenses: dict[str, LensRequest] = LENSES
    same_lens: bool = SAME_LENS
    readouts_ms: dict[str, float] = Field(
        default_factory=dict,
        description="by camera without depth, the time in which it reads a picture from the first row to the last",
    )
    board: str | None = Field(
        default=None,
        max_length=100,
        description="a board in the take's videos, which gives cameras without depth the size of the stage and, on "
        "the floor, floor and origin; as in `calibrate --board`",
        examples=["charuco:5x7:60:45", "apriltag:160"],
    )


class CalibrationsOfTake(Struct):
    """Numbers of a take's calibrations, that of the one in use, and the one in use as in `calibrate --json`; None:
    there is none."""

    numbers: list[int]
    in_use: int | None
    calibration: CalibrationJson | None


class UseRequest(Body):
    """A stored calibration of a take."""

    number: int = Field(ge=1)


class BorrowedCalibration(Struct):
    """A calibration was borrowed, and has this number."""

    number: int
    state: Literal["done"] = "done"


def _calibrations(take: Take) -> CalibrationsOfTake:
    in_use = take.meta["calibration"]
    value = None if in_use is None else take.calibration().to_json()
    return CalibrationsOfTake(take.calibration_numbers(), in_use, value)


def manage_router(sessions: Path, finder: Finder, jobs: Jobs) -> APIRouter:
    """Return the routes that manage the takes in `sessions`."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES, route_class=StructRoute)

    @router.patch("/takes/{session}/{take}")
    def change(session: str, take: str, request: SlateRequest) -> ListedTake:
        """Change a take's names, performers, notes, tags, markers, rating or star; exchange performers; answers its
        line of the list."""
        finder.take(session, take)
        values = request.model_dump()
        if request.markers is not None:
            values["markers"] = tuple(TimelineMarker(one.time_s, one.name) for one in request.markers)
        if request.exchanges is not None:
            values["exchanges"] = tuple(Exchange(one.time_s, one.performers) for one in request.exchanges)
        changed = change_slate(sessions, session, take, Slate(**values))
        return finder.line(take_info(changed.path))

    @router.delete("/takes/{session}/{take}")
    def throw(session: str, take: str) -> Thrown:
        """Move a take to the trash; answers its place there."""
        finder.take(session, take)
        return throw_away(sessions, session, take)

    @router.delete("/takes/{session}/{take}/solves/{solve}")
    def throw_solve(session: str, take: str, solve: str) -> Thrown:
        """Move a solve of a take to the trash; answers its place there."""
        finder.solve(finder.take(session, take), solve)
        return throw_solve_away(sessions, session, take, solve)

    @router.delete("/takes/{session}/{take}/video")
    def throw_video(session: str, take: str) -> Thrown:
        """Move the videos of a take to the trash, the take stays; answers their place there."""
        finder.take(session, take)
        return throw_video_away(sessions, session, take)

    @router.get("/takes/{session}/{take}/calibrations")
    def get_calibrations(session: str, take: str) -> CalibrationsOfTake:
        """Numbers of the take's calibrations, and the one in use."""
        return _calibrations(finder.take(session, take))

    @router.put("/takes/{session}/{take}/calibrations/in_use")
    def put_in_use(session: str, take: str, request: UseRequest) -> CalibrationsOfTake:
        """Use an earlier calibration again; existing solves stay as they are."""
        opened = finder.take(session, take)
        use_calibration(opened, request.number)
        return _calibrations(opened)

    @router.post("/takes/{session}/{take}/calibrations", status_code=202)
    def calibrate(
        session: str, take: str, request: CalibrateRequest | None = None
    ) -> JobStatus | BorrowedCalibration:
        """Calibrate a take again in the background, or borrow another take's calibration at once; answers the job."""
        request = request or CalibrateRequest()
        opened = finder.take(session, take)
        if request.borrow is None:
            job = jobs.submit(
                "calibrate", f"{session}/{take}", "", "studio.library:calibrate", opened,
                reference=request.reference, height_m=request.height_m,
                lenses=known_lenses(request.lenses), same_lens=request.same_lens,
                readouts_ms=request.readouts_ms, board=request.board,
            )  # fmt: skip
            return jobs.get(job.id)
        other_session, _, other = request.borrow.partition("/")
        number = borrow_calibration(opened, finder.take(other_session, other))
        return BorrowedCalibration(number)

    @router.get("/trash", tags=["trash"])
    def get_trash() -> list[Thrown]:
        """The content of the trash, the newest first."""
        return list_trash(sessions)

    @router.post("/trash/{trash_id}/restore", tags=["trash"])
    def put_back(trash_id: str) -> ListedTake:
        """Restore a take, a solve or videos, under another name if its own is taken; answers the take's line."""
        session, name = restore(sessions, trash_id)
        return finder.line(take_info(take_path(sessions, session, name)))

    @router.delete("/trash/{trash_id}", tags=["trash"])
    def delete_one(trash_id: str) -> dict[str, int]:
        """Delete one take of the trash for good."""
        return {"deleted": empty_trash(sessions, trash_id)}

    @router.delete("/trash", tags=["trash"])
    def delete_all() -> dict[str, int]:
        """Delete everything in the trash for good."""
        return {"deleted": empty_trash(sessions)}

    @router.get("/takes/{session}/{take}/file", response_class=FileResponse)
    def get_file(session: str, take: str) -> FileResponse:
        """Download a take as one file, raw frames, calibrations and solves; the file is in `exports/` meanwhile."""
        opened = finder.take(session, take)
        out = inside(opened.path / "exports", f"{take}{ENDING}")
        run_in_process("studio.take.library.bundle:write_bundle", opened, out)
        return FileResponse(out, filename=out.name, media_type="application/zip")

    @router.post("/takes/{session}/{take}/file", status_code=201)
    async def put_file(session: str, take: str, request: Request) -> ListedTake:
        """Make a new take from one file, the request's body."""
        path = take_path(sessions, session, take)
        check_free(path)
        sessions.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".upload-", dir=sessions) as folder:
            file = Path(folder) / "upload.zip"
            await receive(request, file, MAX_BYTES, f"the file is larger than {MAX_BYTES >> 30} GB")
            await run_in_threadpool(run_in_process, "studio.take.library.bundle:read_bundle", file, path)
        return finder.line(await run_in_threadpool(take_info, path))

    return router


async def receive(request: Request, file: Path, most_bytes: int, too_large: str) -> None:
    """Write a request's body to a file, piece by piece.

    Raises:
        FormatError: it is larger than `most_bytes`; `too_large` is the message.
    """
    size = 0
    with file.open("wb") as target:
        async for piece in request.stream():
            size += len(piece)
            if size > most_bytes:
                raise FormatError(too_large)
            await run_in_threadpool(target.write, piece)

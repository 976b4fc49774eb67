"""Routes that measure solves: against a reference file, and against each other."""

from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.find import Finder
from studio.api.stage import Request as Body
from studio.api.work import cleanup_work, compare_work, evaluate_work, report_work
from studio.engine.errors import FormatError
from studio.engine.files import write_atomically
from studio.engine.metrics.kinds import REFERENCE_KINDS
from studio.take.names import check_name, inside
from studio.take.take import Take
from studio.worker import run_in_process

MAX_REFERENCE_BYTES = 512 * 1024**2


class EvaluateRequest(Body):
    """Which reference of the take, and which solves."""

    reference: str = Field(
        description="name of a reference that was sent to the take", examples=["truth.csv"]
    )
    solves: list[str] = Field(default_factory=list, description="all where empty")
    align_time: bool = Field(False, description="the reference has a clock of its own: align it in time too")
    align: Literal["rigid", "similarity"] = Field("rigid", description="similarity aligns the size too")
    unit_m: Annotated[float | None, Field(gt=0, description="metres per unit of a BVH")] = None


def measure_router(finder: Finder) -> APIRouter:
    """Return the routes that measure solves."""
    router = APIRouter(prefix="/api/v1/takes/{session}/{take}", tags=["measure"], responses=RESPONSES)

    @router.get("/references")
    def get_references(session: str, take: str) -> list[str]:
        """Names of the references that were sent to the take."""
        return _references(finder.take(session, take))

    @router.put("/references/{name}", status_code=201)
    async def put_reference(session: str, take: str, name: str, request: Request) -> dict[str, Any]:
        """Keep a reference (BVH, CSV, C3D, TRC, poses.npz, targets) with the take; the file is the request's body."""
        opened = await run_in_threadpool(finder.take, session, take)
        path = _reference_path(opened, name)
        data = bytearray()
        async for piece in request.stream():
            data += piece
            if len(data) > MAX_REFERENCE_BYTES:
                raise FormatError(f"a reference may have {MAX_REFERENCE_BYTES >> 20} MB at most")

        def write() -> None:
            with write_atomically(path) as file:
                file.write(data)

        await run_in_threadpool(write)
        return {"name": name, "bytes": len(data)}

    @router.post("/evaluate")
    def evaluate(session: str, take: str, request: EvaluateRequest) -> dict[str, Any]:
        """Measure solves against a reference; answers what `evaluate --json` holds."""
        opened = finder.take(session, take)
        if request.reference not in _references(opened):
            raise NotFoundError(
                f"take {session}/{take} has no reference {request.reference!r}; send it first"
            )
        names = request.solves or opened.solve_names()
        for name in names:
            finder.solve(opened, name)
        path = _reference_path(opened, request.reference)
        return run_in_process(
            evaluate_work, opened.path, path, names, request.align_time, request.unit_m, request.align
        )

    @router.get("/report", response_class=HTMLResponse)
    def report(
        session: str,
        take: str,
        reference: str,
        solve: Annotated[list[str], Query()] = [],  # noqa: B006, FastAPI copies it
        align_time: bool = False,
        align: Literal["rigid", "similarity"] = "rigid",
        unit_m: Annotated[float | None, Query(gt=0)] = None,
    ) -> HTMLResponse:
        """The report of solves against a reference of the take, as one HTML page; all solves where none is named."""
        opened = finder.take(session, take)
        if reference not in _references(opened):
            raise NotFoundError(f"take {session}/{take} has no reference {reference!r}; send it first")
        names = solve or opened.solve_names()
        for name in names:
            finder.solve(opened, name)
        if not names:
            raise NotFoundError(f"take {session}/{take} has no solve; solve it first")
        path = _reference_path(opened, reference)
        page = run_in_process(report_work, opened.path, path, names, align_time, unit_m, align)
        policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
        return HTMLResponse(page, headers={"Content-Security-Policy": policy, "Cache-Control": "no-store"})

    @router.get("/solves/{name}/cleanup")
    def cleanup(session: str, take: str, name: str, reference: str | None = None) -> dict[str, Any]:
        """The edit list of a solve's exported animation: what would have to be mended, and when.

        Against a reference of the take on the stage clock where one is named; without one, true motion that is
        very sharp counts too.
        """
        opened = finder.take(session, take)
        path = None
        if reference is not None:
            if reference not in _references(opened):
                raise NotFoundError(f"take {session}/{take} has no reference {reference!r}; send it first")
            path = _reference_path(opened, reference)
        return run_in_process(cleanup_work, opened.path, finder.solve(opened, name), path)

    @router.get("/compare")
    def compare(session: str, take: str, a: str, b: str) -> dict[str, Any]:
        """How far solves `a` and `b` are apart [mm], by joint, and the instants that differ most."""
        opened = finder.take(session, take)
        return run_in_process(compare_work, finder.solve(opened, a), finder.solve(opened, b))

    return router


def _references(take: Take) -> list[str]:
    return sorted(
        path.name for path in (take.path / "references").glob("*") if path.suffix.lower() in REFERENCE_KINDS
    )


def _reference_path(take: Take, name: str) -> Path:
    """Return where a reference lies.

    Raises:
        TakeError: a name that is not allowed. FormatError: a kind that is none.
    """
    check_name("reference", name)
    if Path(name).suffix.lower() not in REFERENCE_KINDS:
        raise FormatError(
            f"reference {name!r} is of no kind that is read; allowed: {', '.join(REFERENCE_KINDS)}"
        )
    return inside(take.path / "references", name)

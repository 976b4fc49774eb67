"""Routes that measure solves: against a reference file, and against each other."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse, HTMLResponse
from pydantic import Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.find import Finder
from studio.api.jobs import Jobs
from studio.api.measure_work import evaluate_work, figures_work, report_work, write_report_work
from studio.api.references import find_reference
from studio.api.stage import Request as Body
from studio.api.work import cleanup_work, compare_work
from studio.report.words import Language
from studio.take.names import check_name, inside
from studio.take.references import HowAligned, how_aligned
from studio.take.take import Take
from studio.worker import run_in_process

REPORT_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; img-src data:",
    "Cache-Control": "no-store",
}


class EvaluateRequest(Body):
    """Which reference of the take, and which solves."""

    reference: str = Field(
        description="name of a reference that was sent to the take", examples=["truth.csv"]
    )
    solves: list[str] = Field(default_factory=list, description="all where empty")
    align_time: bool = Field(False, description="the reference has a clock of its own: align it in time too")
    align: Literal["rigid", "similarity"] = Field("rigid", description="similarity aligns the size too")
    unit_m: Annotated[float | None, Field(gt=0, description="metres per unit of a BVH")] = None


class ReportRequest(Body):
    """Which reference of the take, and which solves; the first is what the others are told against."""

    reference: str = Field(examples=["truth.csv"])
    solves: list[str] = Field(default_factory=list, description="all where empty")
    language: Language = "en"


def measure_router(finder: Finder, jobs: Jobs) -> APIRouter:
    """Return the routes that measure solves."""
    router = APIRouter(prefix="/api/v1/takes/{session}/{take}", tags=["measure"], responses=RESPONSES)

    def solves_of(opened: Take, wanted: list[str]) -> list[str]:
        names = wanted or opened.solve_names()
        for name in names:
            finder.solve(opened, name)
        if not names:
            raise NotFoundError(f"take {opened.meta['id']} has no solve; solve it first")
        return names

    @router.post("/evaluate")
    def evaluate(session: str, take: str, request: EvaluateRequest) -> dict[str, Any]:
        """Measure solves against a reference; answers what `evaluate --json` holds."""
        opened = finder.take(session, take)
        path = find_reference(opened, request.reference)
        names = solves_of(opened, request.solves)
        how = HowAligned(request.align_time, request.align, request.unit_m)
        return run_in_process(evaluate_work, opened.path, path, names, how)

    @router.get("/report", response_class=HTMLResponse)
    def report(
        session: str,
        take: str,
        reference: str,
        solve: Annotated[list[str], Query()] = [],  # noqa: B006, FastAPI copies it
        align_time: bool = False,
        align: Literal["rigid", "similarity"] = "rigid",
        unit_m: Annotated[float | None, Query(gt=0)] = None,
        language: Language = "en",
    ) -> HTMLResponse:
        """The report of solves against a reference of the take, as one HTML page; all solves where none is named."""
        opened = finder.take(session, take)
        path = find_reference(opened, reference)
        names = solves_of(opened, solve)
        how = HowAligned(align_time, align, unit_m)
        page = run_in_process(report_work, opened.path, path, names, how, language)
        return HTMLResponse(page, headers=REPORT_HEADERS)

    @router.post("/reports", status_code=202)
    def make_report(session: str, take: str, request: ReportRequest) -> dict[str, Any]:
        """Make the report in the background, with the reference aligned as it is kept; answers the job, whose `name`
        is the report's."""
        opened = finder.take(session, take)
        path = find_reference(opened, request.reference)
        names = solves_of(opened, request.solves)
        name = f"report_{request.reference}.html"
        out = inside(opened.path / "exports", name)
        how = how_aligned(opened, request.reference)
        job = jobs.submit(
            "report", f"{session}/{take}", name, write_report_work, opened.path, path, how, names, out,
            request.language,
        )  # fmt: skip
        return jobs.get(job.id)

    @router.get("/reports/{name}", response_class=FileResponse)
    def get_report(session: str, take: str, name: str) -> FileResponse:
        """A report that was made."""
        check_name("report", name)
        path = inside(finder.take(session, take).path / "exports", name)
        if not (name.startswith("report_") and name.endswith(".html") and path.is_file()):
            raise NotFoundError(f"take {session}/{take} has no report {name!r}; POST .../reports makes one")
        return FileResponse(path, media_type="text/html", headers=REPORT_HEADERS)

    @router.get("/solves/{name}/figures")
    def figures(session: str, take: str, name: str, reference: str | None = None) -> dict[str, Any]:
        """A solve's figures: `own`, and where one is named against a reference, aligned as it is kept."""
        opened = finder.take(session, take)
        poses = finder.solve(opened, name)
        if reference is None:
            return run_in_process(figures_work, opened.path, poses, None, HowAligned())
        path = find_reference(opened, reference)
        return run_in_process(figures_work, opened.path, poses, path, how_aligned(opened, reference))

    @router.get("/solves/{name}/cleanup")
    def cleanup(session: str, take: str, name: str, reference: str | None = None) -> dict[str, Any]:
        """The edit list of a solve's exported animation: what would have to be mended, and when.

        Against a reference of the take on the stage clock where one is named; without one, true motion that is
        very sharp counts too.
        """
        opened = finder.take(session, take)
        path = None if reference is None else find_reference(opened, reference)
        return run_in_process(cleanup_work, opened.path, finder.solve(opened, name), path)

    @router.get("/compare")
    def compare(session: str, take: str, a: str, b: str) -> dict[str, Any]:
        """How far solves `a` and `b` are apart [mm], by joint, and the instants that differ most."""
        opened = finder.take(session, take)
        return run_in_process(compare_work, finder.solve(opened, a), finder.solve(opened, b))

    return router

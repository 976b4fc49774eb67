"""Routes that measure solves against a reference file and against each other."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse, HTMLResponse
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.jobs import Jobs, JobStatus
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.api.takes.references import find_reference
from studio.engine.metrics.results import (
    Cleanup,
    DifferenceSummary,
    Evaluation,
    SeveralEvaluation,
    SolveFigures,
)
from studio.review.report.words import Language
from studio.take.folder.measured import keep_measured
from studio.take.folder.names import check_name, inside
from studio.take.folder.performers import performer_by_name
from studio.take.folder.references import HowAligned, how_aligned, reference_names, reference_path
from studio.take.folder.take import Take
from studio.worker import run_in_process

REPORT_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; img-src data:",
    "Cache-Control": "no-store",
}


class EvaluateRequest(Body):
    """The take's reference and solves."""

    reference: str = Field(
        description="name of a reference that was sent to the take", examples=["truth.csv"]
    )
    solves: list[str] = Field(default_factory=list, description="all where empty")
    align_time: bool = Field(False, description="the reference has a clock of its own: align it in time too")
    align: Literal["rigid", "similarity"] = Field("rigid", description="similarity aligns the size too")
    unit_m: Annotated[float | None, Field(gt=0, description="metres per unit of a BVH")] = None
    performer: str | None = Field(
        None, description="of several performers whose motion the reference is; the first where left out"
    )


class EvaluateTogetherRequest(Body):
    """Solves of several performers."""

    solves: list[str] = Field(default_factory=list, description="all where empty")


class ReportRequest(Body):
    """The take's reference and solves; the others are compared with the first."""

    reference: str = Field(examples=["truth.csv"])
    solves: list[str] = Field(default_factory=list, description="all where empty")
    language: Language = "en"


class Evaluations(Struct):
    """Figures of solves against a reference, by name of the solve, as in `evaluate --json`."""

    solves: dict[str, Evaluation]


class EvaluationsTogether(Struct):
    """Figures of solves of several performers, by name of the solve, as in `evaluate --json`, and the references
    that they were measured against, by performer."""

    solves: dict[str, SeveralEvaluation]
    references: dict[str, str]


def measure_router(finder: Finder, jobs: Jobs) -> APIRouter:
    """Return the routes that measure solves."""
    router = APIRouter(
        prefix="/api/v1/takes/{session}/{take}",
        tags=["measure"],
        responses=RESPONSES,
        route_class=StructRoute,
    )

    def solves_of(opened: Take, wanted: list[str]) -> list[str]:
        names = wanted or opened.solve_names()
        for name in names:
            finder.solve(opened, name)
        if not names:
            raise NotFoundError(
                "take.unsolved", "take {take} has no solve; solve it first", take=opened.meta["id"]
            )
        return names

    def against(opened: Take, reference: str | None) -> tuple[()] | tuple[Path, HowAligned]:
        """A reference's file and stored alignment options; nothing if none is named."""
        return (
            () if reference is None else (find_reference(opened, reference), how_aligned(opened, reference))
        )

    def motions(opened: Take, reference: str, solve: str) -> Path | dict[str, Path]:
        """A reference's file; with several performers the files of those who have one, by performer."""
        path, performers = find_reference(opened, reference), opened.performer_names(solve)
        return references_by_performer(opened, performers, reference) if performers else path

    @router.post("/evaluate")
    def evaluate(session: str, take: str, request: EvaluateRequest) -> Evaluations:
        """Measure solves against a reference; answers as `evaluate --json`."""
        opened = finder.take(session, take)
        path = find_reference(opened, request.reference)
        names = solves_of(opened, request.solves)
        how = HowAligned(request.align_time, request.align, request.unit_m, request.performer)
        found = run_in_process("studio.library:evaluate", opened, path, names, **asdict(how))
        if how == how_aligned(opened, request.reference):
            for name in names:
                folder = opened.performer_folder(name, how.performer)
                keep_measured(folder, None, {request.reference: found[name]})
        return Evaluations(found)

    @router.post("/evaluate-together")
    def evaluate_together(session: str, take: str, request: EvaluateTogetherRequest) -> EvaluationsTogether:
        """Measure all performers that have a reference, all with the stored alignment of the first reference."""
        opened = finder.take(session, take)
        names = solves_of(opened, request.solves)
        files = references_by_performer(opened, opened.performer_names(names[0]))
        if not files:
            raise NotFoundError(
                "reference.of_nobody",
                "no performer of take {take} has a reference; send one for each, and say whose motion it is",
                take=opened.meta["id"],
            )
        how = how_aligned(opened, next(iter(files.values())).name)
        found = run_in_process("studio.take.folder.evaluating:evaluate_references", opened, files, names, how)
        for name, several in found.items():
            for performer, one in several["performers"].items():
                keep_measured(opened.performer_folder(name, performer), None, {files[performer].name: one})
        return EvaluationsTogether(found, {performer: file.name for performer, file in files.items()})

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
        """The report of solves against a reference of the take, as one HTML page; by default of all solves.

        With several performers, it has every performer with a reference.
        """
        opened = finder.take(session, take)
        names = solves_of(opened, solve)
        of = motions(opened, reference, names[0])
        how = HowAligned(align_time, align, unit_m)
        page = run_in_process(
            "studio.review.report.take_report:report_solves", opened, of, names, how, language
        )
        return HTMLResponse(page, headers=REPORT_HEADERS)

    @router.post("/reports", status_code=202)
    def make_report(session: str, take: str, request: ReportRequest) -> JobStatus:
        """Make the report in the background, with the reference aligned as it is kept; answers the job, whose `name`
        is the report's. With several performers, it has every performer with a reference."""
        opened = finder.take(session, take)
        names = solves_of(opened, request.solves)
        of = motions(opened, request.reference, names[0])
        name = f"report_{request.reference}.html"
        out = inside(opened.path / "exports", name)
        how = how_aligned(opened, request.reference)
        job = jobs.submit(
            "report", f"{session}/{take}", name, "studio.review.report.take_report:report_solves",
            opened, of, names, how, request.language, out,
        )  # fmt: skip
        return jobs.get(job.id)

    @router.get("/reports/{name}", response_class=FileResponse)
    def get_report(session: str, take: str, name: str) -> FileResponse:
        """A finished report."""
        check_name("report", name)
        path = inside(finder.take(session, take).path / "exports", name)
        if not (name.startswith("report_") and name.endswith(".html") and path.is_file()):
            raise NotFoundError(
                "report.none",
                "take {session}/{take} has no report {name!r}; POST .../reports makes one",
                session=session,
                take=take,
                name=name,
            )
        return FileResponse(path, media_type="text/html", headers=REPORT_HEADERS)

    @router.get("/solves/{name}/figures")
    def figures(
        session: str, take: str, name: str, reference: str | None = None, performer: str | None = None
    ) -> SolveFigures:
        """A solve's figures: `own`, and those against a named reference with its stored alignment; with several
        performers those of one."""
        opened = finder.take(session, take)
        poses = finder.solve(opened, name, performer)
        how = against(opened, reference)
        found: SolveFigures = run_in_process("studio.review.measure:solve_figures", opened, poses, *how)
        compared = {} if reference is None or found.reference is None else {reference: found.reference}
        keep_measured(poses.parent, found.own, compared)
        return found

    @router.get("/solves/{name}/cleanup")
    def cleanup(
        session: str, take: str, name: str, reference: str | None = None, performer: str | None = None
    ) -> Cleanup:
        """The edit list of a solve's exported animation, with several performers of one: errors to correct, with
        times.

        A named reference of the take is aligned with its stored options. Without a reference, very sharp true motion
        counts too.
        """
        opened = finder.take(session, take)
        poses = finder.solve(opened, name, performer)
        how = against(opened, reference)
        return run_in_process("studio.review.measure:edit_list", opened, poses, *how)

    @router.get("/compare")
    def compare(session: str, take: str, a: str, b: str, performer: str | None = None) -> DifferenceSummary:
        """Differences of solves `a` and `b` [mm], by joint, and the instants with the largest; with several
        performers those of one."""
        opened = finder.take(session, take)
        files = (finder.solve(opened, a, performer), finder.solve(opened, b, performer))
        return run_in_process("studio.review.measure:compare_solves", *files)

    return router


def references_by_performer(take: Take, performers: list[str], first: str = "") -> dict[str, Path]:
    """Return the references of a take by performer, in the performers' order. Of several for one performer, it is the
    one named `first`, else the first by name. Empty where `performers` is empty."""
    found: dict[str, Path] = {}
    if not performers:
        return found
    for name in sorted(reference_names(take), key=lambda name: name != first):
        whose = how_aligned(take, name).performer
        found.setdefault(
            performers[0] if whose is None else performer_by_name(take.meta, whose),
            reference_path(take, name),
        )
    return {performer: found[performer] for performer in performers if performer in found}

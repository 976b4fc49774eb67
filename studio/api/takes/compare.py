"""The route that compares a solve with another motion: a solve of this or another take, or a reference."""

from fastapi import APIRouter
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.api.takes.references import find_reference
from studio.engine.base.errors import SettingsError
from studio.engine.metrics.results import DifferencesOverTime
from studio.take.folder.performers import performer_by_name
from studio.take.folder.references import how_aligned, placed_path
from studio.worker import run_in_process


class SolveOf(Body):
    """A solve of a take."""

    take: str = Field(description="the take's id, session/name", examples=["monday/take_001"])
    solve: str = Field(examples=["studio"])
    performer: str | None = Field(None, description="of several performers; the first where left out")


class Other(Body):
    """The other motion: a solve, or a reference of the same take."""

    take: str | None = Field(None, description="the take's id; the other side's where left out")
    solve: str | None = None
    performer: str | None = Field(None, description="of several performers; that of `a` where left out")
    reference: str | None = None


class CompareRequest(Body):
    """Two motions on one clock."""

    a: SolveOf
    b: Other
    line_up: bool = Field(False, description="bring the other solve to the place and time of `a` first")
    offset_ms: float = Field(
        0.0, ge=-3_600_000, le=3_600_000, description="the other one is so far ahead in its own motion"
    )


def compare_router(finder: Finder) -> APIRouter:
    """Return the route."""
    router = APIRouter(prefix="/api/v1", tags=["measure"], responses=RESPONSES, route_class=StructRoute)

    @router.post("/compare")
    def compare(request: CompareRequest) -> DifferencesOverTime:
        """Differences per joint [mm]: means, 95th percentiles, maxima, over time, and the instants with the largest.

        Two takes begin together, unless they are lined up. A reference is aligned with its stored options, and
        compared with the performer whose motion it is.
        """
        take = finder.by_id(request.a.take)
        other = request.b
        a = finder.solve(take, request.a.solve, request.a.performer)
        if (other.solve is None) == (other.reference is None):
            raise SettingsError("compare.one_of_two", "b is a solve or a reference: give one of the two")
        if other.reference is not None:
            if other.take not in (None, request.a.take):
                raise SettingsError(
                    "compare.references_of",
                    "b.reference: allowed are references of {take}",
                    take=request.a.take,
                )
            file = find_reference(take, other.reference)
            how = how_aligned(take, other.reference)
            kept = placed_path(take, other.reference, request.a.solve)
            a = finder.solve(take, request.a.solve, how.performer)
            return run_in_process(
                "studio.review.measure:reference_differences", take, a, file,
                how, kept, offset_ms=request.offset_ms,
            )  # fmt: skip
        there = finder.by_id(other.take or request.a.take)
        wanted = other.performer or request.a.performer
        known = wanted is None or performer_by_name(there.meta, wanted) in there.performer_names(
            other.solve or ""
        )
        b = finder.solve(there, other.solve or "", wanted if known else None)
        return run_in_process(
            "studio.review.measure:solve_differences", take, a, b,
            another_take=there.path != take.path, lined_up=request.line_up, offset_ms=request.offset_ms,
        )  # fmt: skip

    return router

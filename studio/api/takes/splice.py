"""The route that splices takes."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.jobs import Jobs, JobStatus
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.offline.edits.take_parts import BLEND_S, NEAR_S, TakePart
from studio.take.folder.take import check_free
from studio.take.library.sessions import take_path

_Seconds = Annotated[float, Field(ge=0.0, le=10.0)]


class PartRequest(Body):
    """A part of a solve of a take."""

    take: str = Field(description="its id, session/name", examples=["monday/walk"])
    start_s: float | None = Field(None, description="stage time [s]; from the first frame where left out")
    end_s: float | None = Field(None, description="stage time [s]; to the last frame where left out")
    since_begin: bool = Field(False, description="the times count from the first frame of the solve instead")
    solve: str | None = Field(None, description="finish, studio, live, or the first by name where left out")
    performer: str | None = Field(None, description="of several; the first where left out")


class SpliceRequest(Body):
    """Parts of takes of one performer, as one new take."""

    take: str = Field(description="id of the new take, session/name", examples=["monday/walk_run"])
    parts: Annotated[tuple[PartRequest, ...], Field(min_length=1, max_length=100)]
    times: Annotated[
        int, Field(ge=1, le=100, description="how often all parts come; over 1 makes a loop")
    ] = 1
    blend_s: Annotated[_Seconds, Field(description="length of each seam")] = BLEND_S
    near_s: Annotated[
        _Seconds,
        Field(description="each begin is moved by up to this, to where it is most like the end before it"),
    ] = NEAR_S


def splice_router(sessions: Path, finder: Finder, jobs: Jobs) -> APIRouter:
    """Return the route that splices takes in `sessions`."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES, route_class=StructRoute)

    @router.post("/splices", status_code=202)
    def splice(request: SpliceRequest) -> JobStatus:
        """Splice parts of takes into a new take with the solve `spliced`, in the background; answers the job."""
        parts = [
            TakePart(finder.by_id(one.take), **one.model_dump(exclude={"take"})) for one in request.parts
        ]
        session, _, name = request.take.partition("/")
        out = take_path(sessions, session, name)
        check_free(out)
        job = jobs.submit(
            "splice", request.take, "spliced", "studio.library:splice", parts, out,
            times=request.times, blend_s=request.blend_s, near_s=request.near_s,
        )  # fmt: skip
        return jobs.get(job.id)

    return router

"""Routes of a recorded take's rigid bodies: what each is, and how it sits on its joint."""

from typing import Literal

from fastapi import APIRouter
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.engine.rigid_bodies.known import KnownBody, shape_of
from studio.take.folder.take import Take
from studio.take.rigid_bodies.kept import take_bodies, take_tracks
from studio.take.rigid_bodies.used import forget_body, name_body
from studio.worker import run_in_process


class BodyRequest(Body):
    """The whole description of a rigid body."""

    name: str = Field(max_length=64, examples=["Wand"])
    use: Literal["", "prop", "evidence", "reference"] = Field(default="prop", description='"": only shown')
    joint: str = Field(
        default="", description="the canonical joint it sits on, or the hand that holds it", examples=["head"]
    )
    performer: str = "performer_1"
    shape: str = Field(default="", max_length=80, examples=["cylinder:3,60", "box:10,20,30", "sphere:22"])


class MeasureBodiesRequest(Body):
    """A solve against which bodies on joints are measured."""

    solve: str = Field(examples=["studio"])
    keep_place: bool = Field(default=False, description="where their system stands is right already")


class BodyOfTake(Struct):
    """A rigid body: its number of readings, what is known of it (null: nothing), and the median distance between its
    joint and the joint's place by the body [mm] (null: not measured)."""

    name: str
    readings: int
    known: KnownBody | None
    residual_mm: float | None


class BodiesOfTake(Struct):
    """A take's rigid bodies; `outdated`: measured under another calibration than the one in use; none is evidence
    until they are measured again."""

    bodies: list[BodyOfTake]
    outdated: bool


def bodies_router(finder: Finder) -> APIRouter:
    """Return the routes."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES, route_class=StructRoute)

    @router.get("/takes/{session}/{take}/rigid-bodies")
    def get_bodies(session: str, take: str) -> BodiesOfTake:
        """The rigid bodies that were tracked while a take was recorded, or that its cameras saw."""
        return _shown(finder.take(session, take))

    @router.put("/takes/{session}/{take}/rigid-bodies")
    def change_body(session: str, take: str, request: BodyRequest) -> BodiesOfTake:
        """Say what a rigid body is, or forget it without a use; later solves and exports follow."""
        opened = finder.take(session, take)
        if not request.use:
            forget_body(opened, request.name)
        else:
            shape = shape_of(request.shape) if request.shape else None
            name_body(opened, KnownBody(request.name, request.use, request.joint, request.performer, shape))
        return _shown(opened)

    @router.post("/takes/{session}/{take}/rigid-bodies/measure")
    def measure_bodies(session: str, take: str, request: MeasureBodiesRequest) -> BodiesOfTake:
        """Measure against a solve how bodies sit on their joints, and where their system stands."""
        opened = finder.take(session, take)
        finder.solve(opened, request.solve)
        run_in_process(
            "studio.take.rigid_bodies.used:measure", opened, request.solve, place=not request.keep_place
        )
        return _shown(opened)

    return router


def _shown(take: Take) -> BodiesOfTake:
    known = take_bodies(take)
    found = [
        BodyOfTake(
            name, len(track.time_s), known.named(name),
            known.ties[name].residual_mm if name in known.ties else None,
        )
        for name, track in take_tracks(take).tracks.items()
    ]  # fmt: skip
    return BodiesOfTake(
        found, known.calibration is not None and known.calibration != take.meta["calibration"]
    )

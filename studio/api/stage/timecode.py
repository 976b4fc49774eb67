"""Routes of incoming timecode."""

from pathlib import Path

from fastapi import APIRouter
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.engine.timecode.timecode import RATES
from studio.live import LiveStage
from studio.timecode.chosen import choose_and_store
from studio.timecode.incoming import TimecodeStatus


class TimecodeRequest(Request):
    """What to listen to."""

    source: str = Field(
        max_length=300,
        description="off, clock, ltc:<device or file>, mtc:<MIDI device> or artnet[:<address>[:<port>]]",
        examples=["clock"],
    )
    rate: str = Field("25", max_length=20, description=", ".join(RATES))


def timecode_router(stage: LiveStage, sessions: Path) -> APIRouter:
    """Return the routes of timecode."""
    router = APIRouter(prefix="/api/v1", tags=["stage"], responses=RESPONSES, route_class=StructRoute)

    @router.put("/timecode")
    def put_timecode(request: TimecodeRequest) -> TimecodeStatus:
        """Listen to this source from now on, at this rate; `off`: to none. `timecode` of the status shows it."""
        choose_and_store(sessions, stage.timecode, request.source, request.rate)
        return stage.timecode.status()

    return router

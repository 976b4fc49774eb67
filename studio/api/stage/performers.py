"""Routes of performers: measuring one in a T-pose, and the stored profiles."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.live import LiveStage
from studio.live.calibration.performers import ProfileJson, delete_profile, list_profiles, load_profile
from studio.live.calibration.tpose import COUNTDOWN_S
from studio.live.states import CalibrationStatus, PerformerStatus, TPose


class TPoseRequest(Request):
    """The performer's name, and the length of the countdown."""

    performer: str = Field(
        default="", description="a name keeps the proportions as a profile", examples=["Ada"]
    )
    countdown_s: Annotated[float, Field(ge=0, le=60)] = COUNTDOWN_S


def performers_router(stage: LiveStage) -> APIRouter:
    """Return the routes of performers."""
    router = APIRouter(prefix="/api/v1", tags=["performers"], responses=RESPONSES, route_class=StructRoute)

    @router.post("/tpose/start", status_code=202)
    def start(request: TPoseRequest | None = None) -> TPose:
        """Count down, then measure the performer once a T-pose is held for 2 s; the status shows the progress."""
        request = request or TPoseRequest()
        stage.start_tpose(request.performer, request.countdown_s)
        return stage.status().calibration.tpose

    @router.post("/tpose/cancel")
    def cancel() -> TPose:
        """Cancel the measurement."""
        stage.cancel_tpose()
        return stage.status().calibration.tpose

    @router.post("/performers/forget")
    def forget() -> list[PerformerStatus]:
        """Go on with the first performer: further ones are strangers again, who hold a T-pose to come back."""
        stage.forget_performers()
        return stage.status().performers

    @router.get("/performers")
    def get_performers() -> list[ProfileJson]:
        """All profiles: name, when measured, height, bones."""
        return [profile.to_json() for profile in list_profiles(stage.sessions)]

    @router.get("/performers/{name}")
    def get_performer(name: str) -> ProfileJson:
        """One profile."""
        return load_profile(stage.sessions, name).to_json()

    @router.post("/performers/{name}/use")
    def use_performer(name: str) -> CalibrationStatus:
        """Use these proportions from now on, also within a recording."""
        stage.use_performer(name)
        return stage.status().calibration

    @router.delete("/performers/{name}")
    def delete_performer(name: str) -> dict[str, str]:
        """Delete a profile; takes keep the proportions of their recording."""
        delete_profile(stage.sessions, name)
        return {"deleted": name}

    return router

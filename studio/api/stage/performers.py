"""Routes of performers: measuring one in a T-pose, several on the stage, and the stored profiles."""

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


class PerformerRequest(Request):
    """A performer on the stage, by name."""

    performer: str = Field(examples=["performer_2"])


class ForgetRequest(Request):
    """The performer to forget; all but the first if left out."""

    performer: str | None = None


class RenameRequest(PerformerRequest):
    """A performer's new name; no two on the stage may have the same."""

    name: str = Field(examples=["Ada"])


class ExchangeRequest(Request):
    """Two performers on the stage, by name."""

    first: str = Field(examples=["performer_1"])
    second: str = Field(examples=["performer_2"])


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
    def forget(request: ForgetRequest | None = None) -> list[PerformerStatus]:
        """Forget a performer, or all but the first. They are strangers again and return by holding a T-pose."""
        stage.forget_performers((request or ForgetRequest()).performer)
        return stage.status().performers

    @router.post("/performers/rename")
    def rename(request: RenameRequest) -> list[PerformerStatus]:
        """Rename a performer on the stage, also within a recording."""
        stage.rename_performer(request.performer, request.name)
        return stage.status().performers

    @router.post("/performers/exchange")
    def exchange(request: ExchangeRequest) -> list[PerformerStatus]:
        """Exchange the identities of two performers on the stage from now on, also within a recording; the same
        request undoes it."""
        stage.exchange_performers(request.first, request.second)
        return stage.status().performers

    @router.post("/performers/keep")
    def keep(request: PerformerRequest) -> ProfileJson:
        """Store the proportions of a performer on the stage as the profile of their name; an older one is
        replaced. A performer who is measured later and has these bones gets the name."""
        stage.keep_profile(request.performer)
        return load_profile(stage.sessions, request.performer).to_json()

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

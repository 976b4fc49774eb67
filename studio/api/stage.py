"""Routes of the live stage: status, recording, settings, calibration."""

from typing import Any

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from studio.api import switches
from studio.api.errors import RESPONSES, NotFoundError
from studio.live import LiveStage
from studio.live.stage import CALIBRATION_S
from studio.take.presets import Presets

_PNG: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": {}}, "description": "The picture."}}


class Request(BaseModel):
    """A request's body; unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class RecordRequest(Request):
    """Names of the take; both may be left out."""

    session: str | None = Field(None, description="session; the date where left out")
    take: str | None = Field(None, description="take; the session's next number where left out")


class RecordStarted(BaseModel):
    """The take that is being recorded."""

    session: str
    take: str


class RecordStopped(RecordStarted):
    """What was recorded."""

    seconds: float
    frames: int = Field(description="camera frames")
    poses: int = Field(description="frames of the live solve; 0 means that there is none")
    problem: str = Field(description="why the recording is incomplete, else empty")


class SettingsRequest(Request):
    """A preset and what differs from it."""

    preset: str = "studio"
    set: dict[str, str | float] = Field(
        default_factory=dict, description="switches by key, as --set KEY=VALUE"
    )


class CalibrationRequest(Request):
    """How a calibration is made."""

    seconds: float = Field(CALIBRATION_S, description="how long frames are gathered: a T-pose, then a walk")
    performer: str = Field("", description="who walks; somebody of another height is refused")


def stage_router(stage: LiveStage, presets: Presets) -> APIRouter:
    """Return the routes of the live stage."""
    router = APIRouter(prefix="/api/v1", tags=["stage"], responses=RESPONSES)

    @router.get("/status")
    async def get_status() -> dict[str, Any]:
        """Cameras, pipeline, recording and calibration, at most a fifth of a second old."""
        return stage.status()

    @router.post("/record/start", status_code=201)
    def start_recording(request: RecordRequest | None = None) -> RecordStarted:
        """Begin a take. The live pipeline starts afresh with it."""
        request = request or RecordRequest()
        return RecordStarted(**stage.start_recording(request.session, request.take))

    @router.post("/record/stop")
    def stop_recording() -> RecordStopped:
        """End the take; its live solve is saved as `live`."""
        return RecordStopped(**stage.stop_recording())

    @router.put("/cameras/{name}/reference")
    def put_reference(name: str) -> dict[str, Any]:
        """Make the camera's clock the stage clock; answers the cameras of the status. Not while recording."""
        stage.choose_reference(name)
        return stage.status()["cameras"]

    @router.get("/cameras/{name}/preview", response_class=Response, responses=_PNG)
    def get_preview(name: str) -> Response:
        """The newest small depth image that the camera's client sent, as PNG: near is bright, black is no reading."""
        png = stage.previews.png(name)
        if png is None:
            raise NotFoundError(
                f"there is no preview of camera {name!r}: only clients of depth cameras send them, and `previews` in "
                "the status counts them"
            )
        return Response(png, media_type="image/png", headers={"Cache-Control": "no-store"})

    @router.get("/switches")
    def get_switches() -> dict[str, Any]:
        """Every switch with its values and explanation, and the presets."""
        return switches.catalogue(presets)

    @router.get("/settings")
    def get_settings() -> dict[str, Any]:
        """The live settings: the nearest preset, what differs from it, and every switch as text."""
        return switches.describe(stage.settings(), presets.all())

    @router.put("/settings")
    def put_settings(request: SettingsRequest) -> dict[str, Any]:
        """Use a preset with changes from now on, also within a recording."""
        stage.set_settings(switches.from_request(presets, request.preset, request.set))
        return switches.describe(stage.settings(), presets.all())

    @router.post("/calibration/start", status_code=202)
    def start_calibration(request: CalibrationRequest | None = None) -> dict[str, Any]:
        """Gather frames of all cameras, then calibrate; `calibration.attempt` of the status tells how it goes."""
        request = request or CalibrationRequest()
        stage.start_calibration(request.seconds, request.performer)
        return stage.status()["calibration"]

    @router.post("/calibration/finish", status_code=202)
    def finish_calibration() -> dict[str, Any]:
        """Calibrate with what was gathered so far: the coverage says when it is enough."""
        stage.finish_calibration()
        return stage.status()["calibration"]

    @router.get("/calibration")
    def get_calibration() -> dict[str, Any]:
        """The state, as in the status, and as `calibration` the one in use (null: none), as `calibrate --json`."""
        calibration = stage.calibration()
        value = None if calibration is None else calibration.to_json()
        return {**stage.status()["calibration"], "calibration": value}

    return router

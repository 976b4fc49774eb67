"""Routes of the live stage: status, recording, settings, calibration."""

from typing import Any

from fastapi import APIRouter, Response
from msgspec import structs
from pydantic import BaseModel, ConfigDict, Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.lenses import LENSES, SAME_LENS, LensRequest, known_lenses
from studio.api.stage import switches
from studio.api.structs import StructRoute
from studio.engine.calibration.views.seen.known_lens import KnownLenses
from studio.engine.model.calibration import CalibrationJson
from studio.live import LiveStage
from studio.live.stage import CALIBRATION_S
from studio.live.states import CalibrationStatus, CameraStatus, RecordStarted, RecordStopped, StageStatus
from studio.take.library.presets import Presets

_PNG: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": {}}, "description": "The picture."}}


class Request(BaseModel):
    """A request's body; unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class RecordRequest(Request):
    """Names of the take; both may be left out."""

    session: str | None = Field(default=None, description="session; the date where left out")
    take: str | None = Field(default=None, description="take; the session's next number where left out")


class SettingsRequest(Request):
    """A preset and changes."""

    preset: str = "studio"
    set: dict[str, str | float] = Field(
        default_factory=dict, description="switches by key, as --set KEY=VALUE"
    )


class CalibrationRequest(Request):
    """Options of a calibration."""

    seconds: float = Field(
        default=CALIBRATION_S, description="how long frames are gathered: a T-pose, then a walk"
    )
    performer: str = Field(default="", description="who walks; somebody of another height is refused")
    height_m: float | None = Field(
        default=None,
        description="the performer's height without shoes [m]; where no camera sees depth, it gives the stage's size",
    )
    lenses: dict[str, LensRequest] = LENSES
    same_lens: bool = SAME_LENS


class CalibrationInUse(CalibrationStatus, kw_only=True):
    """The state of the calibration, and the one in use as in `calibrate --json`; None: there is none."""

    calibration: CalibrationJson | None


def stage_router(stage: LiveStage, presets: Presets) -> APIRouter:
    """Return the routes of the live stage."""
    router = APIRouter(prefix="/api/v1", tags=["stage"], responses=RESPONSES, route_class=StructRoute)

    @router.get("/status")
    async def get_status() -> StageStatus:
        """Cameras, pipeline, recording and calibration, at most a fifth of a second old."""
        return stage.status()

    @router.post("/record/start", status_code=201)
    def start_recording(request: RecordRequest | None = None) -> RecordStarted:
        """Start a take, with a fresh live pipeline."""
        request = request or RecordRequest()
        return stage.start_recording(request.session, request.take)

    @router.post("/record/stop")
    def stop_recording() -> RecordStopped:
        """End the take; its live solve is saved as `live`."""
        return stage.stop_recording()

    @router.put("/cameras/{name}/reference")
    def put_reference(name: str) -> dict[str, CameraStatus]:
        """Make the camera's clock the stage clock; answers the cameras of the status. Not while recording."""
        stage.choose_reference(name)
        return stage.status().cameras

    @router.get("/cameras/{name}/preview", response_class=Response, responses=_PNG)
    def get_preview(name: str) -> Response:
        """The newest small depth image of the camera's client, as PNG: near is bright, black is no reading."""
        png = stage.previews.png(name)
        if png is None:
            raise NotFoundError(
                "camera.no_preview",
                "there is no preview of camera {name!r}: only clients of depth cameras send them, "
                "and `previews` in the status counts them",
                name=name,
            )
        return Response(png, media_type="image/png", headers={"Cache-Control": "no-store"})

    @router.get("/switches")
    def get_switches() -> switches.Catalogue:
        """Every switch with its values and explanation, and the presets."""
        return switches.catalogue(presets)

    @router.get("/settings")
    def get_settings() -> switches.SettingsInUse:
        """The live settings: the nearest preset, the differences from it, and every switch as text."""
        return switches.describe(stage.settings(), presets.all())

    @router.put("/settings")
    def put_settings(request: SettingsRequest) -> switches.SettingsInUse:
        """Use a preset with changes from now on, also within a recording."""
        stage.set_settings(switches.from_request(presets, request.preset, request.set))
        return switches.describe(stage.settings(), presets.all())

    @router.post("/calibration/start", status_code=202)
    def start_calibration(request: CalibrationRequest | None = None) -> CalibrationStatus:
        """Gather frames of all cameras, then calibrate; `calibration.attempt` of the status shows the progress."""
        request = request or CalibrationRequest()
        lenses = KnownLenses(known_lenses(request.lenses), request.same_lens)
        stage.start_calibration(request.seconds, request.performer, request.height_m, lenses)
        return stage.status().calibration

    @router.post("/calibration/finish", status_code=202)
    def finish_calibration() -> CalibrationStatus:
        """Calibrate with the frames gathered so far; the coverage says when they are enough."""
        stage.finish_calibration()
        return stage.status().calibration

    @router.get("/calibration")
    def get_calibration() -> CalibrationInUse:
        """The state, as in the status, and as `calibration` the one in use (null: none), as in `calibrate --json`."""
        calibration = stage.calibration()
        value = None if calibration is None else calibration.to_json()
        return CalibrationInUse(**structs.asdict(stage.status().calibration), calibration=value)

    return router

"""The server's app: all routes of `/api/v1` on one live stage."""

import time
from importlib import metadata
from pathlib import Path

from fastapi import FastAPI

from studio.api.access import Access, AccessGuard, access_router
from studio.api.add_cameras import add_cameras_router
from studio.api.blind import blind_router
from studio.api.compare import compare_router
from studio.api.errors import add_error_handlers
from studio.api.events import events_router
from studio.api.exports import exports_router
from studio.api.find import Finder
from studio.api.jobs import Jobs
from studio.api.limits import BodyGuard, PlainAnswers
from studio.api.link import HELLO_TIMEOUT_S, link_router
from studio.api.local_cameras import LocalCameras
from studio.api.manage import manage_router
from studio.api.measure import measure_router
from studio.api.operations import operations_router
from studio.api.origin import OriginGuard
from studio.api.outputs import outputs_router
from studio.api.performers import performers_router
from studio.api.presets import presets_router
from studio.api.recordings import Recordings
from studio.api.references import references_router
from studio.api.remote import remote_router
from studio.api.rigs import rigs_router
from studio.api.shares import shares_router
from studio.api.stage import stage_router
from studio.api.takes import takes_router
from studio.api.thumbnails import Thumbnails, thumbnails_router
from studio.api.vote import vote_router
from studio.blind.desk import Desk
from studio.engine.calibration.result import Performer
from studio.live import LiveStage
from studio.share.store import Shares
from studio.streams import Outputs
from studio.take.presets import Presets

_DESCRIPTION = """
Operate the studio: cameras, recording, settings, calibration, takes. The page does all it does through these
routes. Failures have one shape, `{"error": {"code", "message"}}`. Three WebSockets are not listed below:
`/api/v1/link` for camera clients (docs/protocol.md), `/api/v1/events`, which sends the status, and
`/api/v1/stream`, which sends the solved character (docs/streaming.md).
"""


def create_app(
    stage: LiveStage,
    sessions: Path,
    *,
    access: Access | None = None,
    recordings: Path | None = None,
    hello_timeout_s: float = HELLO_TIMEOUT_S,
) -> FastAPI:
    """Return the app of a stage that the caller starts and closes; `state.outputs` and `state.local_cameras` are
    closed with it, what others put into `state.events` goes out with every event.

    Args:
        stage: the live stage.
        sessions: folder of the takes; nothing outside it is served.
        access: who may do what; nobody is asked for anything where None.
        recordings: folder whose recordings may be played as cameras, beside the takes.
        hello_timeout_s: a camera link that says nothing for so long is refused.
    """
    app = FastAPI(
        title="Capture Studio",
        version=metadata.version("capture-studio"),
        description=_DESCRIPTION,
        docs_url="/api/docs",
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
    )
    jobs = Jobs()
    access = access or Access(sessions, required=False, now_s=time.monotonic)
    add_error_handlers(app)
    app.add_middleware(BodyGuard)
    app.add_middleware(AccessGuard, access=access)
    app.add_middleware(OriginGuard)
    app.add_middleware(PlainAnswers)  # the last one added is the first to look
    app.include_router(access_router(access))
    app.include_router(remote_router(access))
    app.state.local_cameras = LocalCameras(stage, access.own_camera_token)
    app.include_router(add_cameras_router(access, app.state.local_cameras, Recordings(sessions, recordings)))
    app.include_router(link_router(stage, access, hello_timeout_s=hello_timeout_s))
    app.state.events = {"local_cameras": app.state.local_cameras.status}
    app.include_router(events_router(stage, jobs, app.state.events))
    presets, thumbnails = Presets(sessions), Thumbnails(stage)
    app.state.events["thumbnails"] = lambda: thumbnails.made
    app.include_router(stage_router(stage, presets))
    app.include_router(presets_router(presets))
    finder = Finder(stage, sessions)
    app.include_router(performers_router(stage))
    app.include_router(takes_router(sessions, finder, jobs, presets, thumbnails))
    app.include_router(thumbnails_router(finder))
    app.include_router(exports_router(sessions, finder, jobs))
    app.include_router(rigs_router(sessions))
    app.include_router(manage_router(sessions, finder, jobs))
    app.include_router(references_router(sessions, finder))
    app.include_router(measure_router(finder, jobs))
    app.include_router(compare_router(finder))
    app.include_router(operations_router(stage))
    desk = Desk(sessions)
    app.include_router(blind_router(finder, jobs, desk))
    app.include_router(vote_router(desk))
    app.include_router(shares_router(finder, Shares(sessions)))
    app.state.outputs = Outputs(sessions, lambda: performer_of(stage))
    stage.subscribe(app.state.outputs.add)
    app.include_router(outputs_router(stage, app.state.outputs))
    return app


def performer_of(stage: LiveStage) -> Performer | None:
    """Return the proportions in use, None before there are any."""
    calibration = stage.calibration()
    return None if calibration is None else calibration.performer

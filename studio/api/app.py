"""The server's app: all routes of `/api/v1` on one live stage."""

import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

from fastapi import FastAPI

from studio.api.access import Access, AccessGuard, access_router
from studio.api.add_routes import add_routes
from studio.api.cameras.add_cameras import add_cameras_router
from studio.api.cameras.announced import Announced
from studio.api.cameras.device_routes import devices_router
from studio.api.cameras.devices import Devices
from studio.api.cameras.keep_video import keep_video_router
from studio.api.cameras.link import HELLO_TIMEOUT_S, link_router
from studio.api.cameras.local_cameras import LocalCameras
from studio.api.cameras.phones import phones_router
from studio.api.cameras.recordings import Recordings
from studio.api.cameras.remote import remote_router
from studio.api.cameras.video_parts import video_parts_router
from studio.api.errors import ErrorBody, add_error_handlers
from studio.api.jobs import Jobs
from studio.api.limits import BodyGuard, PlainAnswers
from studio.api.origin import OriginGuard
from studio.api.sharing.blind import blind_router
from studio.api.sharing.shares import shares_router
from studio.api.sharing.vote import vote_router
from studio.api.stage.events import StatusEvent, events_router
from studio.api.stage.operations import operations_router
from studio.api.stage.outputs import outputs_router
from studio.api.stage.performers import performers_router
from studio.api.stage.presets import presets_router
from studio.api.stage.rigid_bodies import rigid_bodies_router
from studio.api.stage.robots import robots_router
from studio.api.stage.stage import stage_router
from studio.api.stage.timecode import timecode_router
from studio.api.stage.triggers import make_triggers, triggers_router
from studio.api.structs import StructApi
from studio.api.takes.boards import boards_router
from studio.api.takes.bodies import bodies_router
from studio.api.takes.changes import Changes
from studio.api.takes.compare import compare_router
from studio.api.takes.edits import EditsStamp, edits_router
from studio.api.takes.exports import exports_router
from studio.api.takes.find import Finder
from studio.api.takes.imports import imports_router
from studio.api.takes.manage import manage_router
from studio.api.takes.measure import measure_router
from studio.api.takes.references import references_router
from studio.api.takes.rigs import rigs_router
from studio.api.takes.splice import splice_router
from studio.api.takes.takes import takes_router
from studio.api.takes.thumbnails import Thumbnails, thumbnails_router
from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import Sentence
from studio.engine.identity.recognised import FIRST
from studio.live import LiveStage
from studio.live.keeping.video import LateVideos
from studio.review.blind.desk import Desk
from studio.review.share.store import Shares
from studio.streams import Member, Outputs
from studio.take.library.presets import Presets
from studio.timecode.chosen import choose_stored

_DESCRIPTION = """
Operate the studio: cameras, recording, settings, calibration, takes. The page does all it does through these
routes. Failures have one shape, `{"error": {"code", "message"}}`. Three WebSockets are not listed below:
`/api/v1/link` for camera clients (docs/protocol.md), `/api/v1/events`, which sends the schema `StatusEvent`, and
`/api/v1/stream`, which sends the solved character (docs/streaming.md). An object with texts for people has
their codes in `said`, a list of the schema `Sentence` (docs/api.md).
"""


def create_app(
    stage: LiveStage,
    sessions: Path,
    *,
    access: Access | None = None,
    recordings: Path | None = None,
    discover: bool | None = None,
    certificate: Path | None = None,
    hello_timeout_s: float = HELLO_TIMEOUT_S,
    on_page: Callable[[], None] = lambda: None,
) -> FastAPI:
    """Return the app of a stage that the caller starts and closes; `state.outputs`, `state.local_cameras`,
    `state.devices`, `state.announced` and `state.triggers` are closed with it, and every event includes the content
    of `state.events`.

    Args:
        stage: the live stage.
        sessions: folder of the takes; nothing outside it is served.
        access: access control; None = nobody needs to sign in.
        recordings: folder whose recordings may be played as cameras, in addition to the takes.
        discover: listen to cameras that announce themselves; None = where nobody needs to sign in.
        certificate: the server's own, by which its own clients recognise it; None = it has none.
        hello_timeout_s: time without a message after which a camera link is refused.
        on_page: called for each page that is opened.
    """
    app = StructApi(
        title="Capture Studio",
        version=metadata.version("capture-studio"),
        description=_DESCRIPTION,
        docs_url="/api/docs",
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
    )
    app.events, app.failure = (StatusEvent, Sentence), ErrorBody
    app.state.jobs = jobs = Jobs()
    access = access or Access(sessions, required=False, now_s=time.monotonic)
    app.state.open_to_others = access.required
    add_error_handlers(app)
    app.add_middleware(BodyGuard)
    app.add_middleware(AccessGuard, access=access)
    app.add_middleware(OriginGuard)
    app.add_middleware(PlainAnswers)  # the last one added runs first
    add_routes(app, access_router(access))
    add_routes(app, remote_router(access))
    app.state.local_cameras = LocalCameras(stage, access.own_camera_token, certificate)
    add_routes(app, add_cameras_router(access, app.state.local_cameras, Recordings(sessions, recordings)))
    add_routes(app, phones_router(access, stage, certificate))
    app.state.devices = Devices(stage, access.own_camera_token, certificate)
    app.state.announced = Announced(stage, access, on=not access.required if discover is None else discover)
    add_routes(app, devices_router(app.state.devices, app.state.announced))
    add_routes(app, keep_video_router(access))
    add_routes(app, video_parts_router(access, LateVideos(sessions)))
    add_routes(app, link_router(stage, access, hello_timeout_s=hello_timeout_s))
    events: dict[str, Callable[[], Any]] = {
        "local_cameras": app.state.local_cameras.status,
        "devices": lambda: [*app.state.devices.clicked(), *app.state.announced.clicked()],
    }
    app.state.events = events
    add_routes(app, events_router(stage, jobs, events, on_page))
    presets, thumbnails = Presets(sessions), Thumbnails(stage)
    events["thumbnails"] = lambda: thumbnails.made
    events["takes"] = Changes(sessions).stamp
    add_routes(app, stage_router(stage, presets))
    add_routes(app, presets_router(presets))
    add_routes(app, timecode_router(stage, sessions))
    choose_stored(sessions, stage.timecode)
    stage.bodies.start()
    finder = Finder(stage, sessions)
    for error in (FileNotFoundError, FormatError):
        app.add_exception_handler(error, finder.gone)
    add_routes(app, rigid_bodies_router(stage, sessions, finder.by_id))
    app.state.triggers = make_triggers(stage, sessions, jobs)
    add_routes(app, triggers_router(app.state.triggers))
    events["triggers"] = app.state.triggers.status
    add_routes(app, performers_router(stage))
    add_routes(app, takes_router(sessions, finder, jobs, presets, thumbnails))
    add_routes(app, edits_router(finder, jobs))
    app.state.edits_stamp = EditsStamp(sessions)
    add_routes(app, thumbnails_router(finder))
    add_routes(app, exports_router(sessions, finder, jobs))
    add_routes(app, imports_router(sessions, jobs))
    add_routes(app, rigs_router(sessions))
    add_routes(app, robots_router(sessions))
    add_routes(app, manage_router(sessions, finder, jobs))
    add_routes(app, boards_router())
    add_routes(app, bodies_router(finder))
    add_routes(app, splice_router(sessions, finder, jobs))
    app.state.player = None  # of the view, if one is mounted
    add_routes(app, references_router(sessions, finder, lambda *gone: _let_go(app, *gone)))
    add_routes(app, measure_router(finder, jobs))
    add_routes(app, compare_router(finder))
    add_routes(app, operations_router(stage))
    desk = Desk(sessions)
    add_routes(app, blind_router(finder, jobs, desk))
    add_routes(app, vote_router(desk))
    add_routes(app, shares_router(finder, Shares(sessions)))
    app.state.outputs = Outputs(sessions, lambda: cast_of(stage))
    stage.subscribe(app.state.outputs.add)
    add_routes(app, outputs_router(stage, app.state.outputs))
    return app


def _let_go(app: FastAPI, take: str, reference: str) -> None:
    """Remove a take's reference from the view."""
    if app.state.player is not None:
        app.state.player.let_go(take, reference)


def cast_of(stage: LiveStage) -> dict[int, Member]:
    """Return the performers by number, as live output has them."""
    several = stage.members()
    if several:
        return {number: Member(one.name, one.proportions) for number, one in several.items()}
    calibration = stage.calibration()
    return {FIRST: Member("", None if calibration is None else calibration.performer)}

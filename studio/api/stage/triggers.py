"""Routes of triggers, and what joins them with the live stage and the jobs."""

from pathlib import Path

import msgspec
from fastapi import APIRouter
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES
from studio.api.jobs import Jobs
from studio.api.stage.stage import Request
from studio.api.structs import StructRoute
from studio.live import LiveStage
from studio.live.states import RecordStarted, RecordStopped
from studio.take.library.sessions import session_of_today, take_path
from studio.triggers.settings import TriggerSettings
from studio.triggers.tellers import TriggerNews
from studio.triggers.triggers import Triggers, TriggersStatus

_HIDDEN = "********"
"""Placeholder of the token in shown settings; in a change it means that the token stays."""


class TriggerRequest(Request):
    """Changes of the triggers; fields that are left out stay."""

    xml: bool | None = Field(None, description="hear CaptureStart and CaptureStop over UDP")
    osc: bool | None = Field(None, description="hear /record/start, /record/stop and /record/state over UDP")
    midi: bool | None = Field(None, description="a note of a MIDI device starts and stops")
    xml_out: bool | None = Field(None, description="send CaptureStart and CaptureStop")
    webhooks: bool | None = Field(None, description="post JSON on start, stop and solved")
    host: str | None = Field(None, description="address of this machine to listen at")
    xml_port: int | None = None
    osc_port: int | None = None
    midi_device: str | None = Field(None, max_length=300, description="file that gives its bytes")
    midi_note: int | None = None
    xml_targets: list[str] | None = Field(None, examples=[["192.168.1.20:30"]])
    webhook_urls: list[str] | None = None
    token: str | None = Field(None, description="that requests must have; empty = none")


class TriggersShown(Struct):
    """The settings, with asterisks for a token, and what each trigger received and sent."""

    settings: TriggerSettings
    status: TriggersStatus


class StageTriggered:
    """The live stage, as triggers operate it (`Recorded`)."""

    def __init__(self, stage: LiveStage) -> None:
        self._stage = stage

    def recording_name(self) -> str | None:
        """Return `<session>/<take>` of the recording under way, or None."""
        return self._stage.recording_name()

    def start_trigger(self, session: str | None, take: str | None, notes: str) -> str:
        """Start a take and return its name; a number is appended to a name that is taken.

        Raises:
            StudioError: as `LiveStage.start_recording`.
        """
        session = session_of_today() if session is None else session
        if take is not None:
            number, wanted = 2, take
            while take_path(self._stage.sessions, session, take).exists():
                take, number = f"{wanted}_{number}", number + 1
        started = self._stage.start_recording(session, take, notes)
        return f"{started.session}/{started.take}"

    def stop_trigger(self) -> str:
        """End the take and return its name.

        Raises:
            StudioError: as `LiveStage.stop_recording`.
        """
        stopped = self._stage.stop_recording()
        return f"{stopped.session}/{stopped.take}"


class _Solves:
    """Reports each finished solve once."""

    def __init__(self, jobs: Jobs, triggers: Triggers) -> None:
        self._jobs, self._triggers = jobs, triggers
        self._told: set[str] = set()

    def look(self) -> None:
        """Report the solves that finished since the last look."""
        done = [job for job in self._jobs.list() if job.kind == "solve" and job.state == "done"]
        for job in done:
            if job.id not in self._told:
                session, _, take = (job.take or "").partition("/")
                self._triggers.tell(TriggerNews("solved", session, take, solve=job.name or ""))
        self._told = {job.id for job in done}


def make_triggers(stage: LiveStage, sessions: Path, jobs: Jobs) -> Triggers:
    """Return the triggers of a stage; its recordings and solves are reported to them."""

    def timecode() -> str:
        return stage.timecode.status().timecode

    triggers = Triggers(sessions, StageTriggered(stage), timecode)

    def recorded(what: RecordStarted) -> None:
        stopped = isinstance(what, RecordStopped)
        seconds = what.seconds if isinstance(what, RecordStopped) else 0.0
        event = "stop" if stopped else "start"
        triggers.tell(TriggerNews(event, what.session, what.take, timecode(), seconds=seconds))

    stage.recordings.on_recorded = recorded
    jobs.listen(_Solves(jobs, triggers).look)
    return triggers


def triggers_router(triggers: Triggers) -> APIRouter:
    """Return the routes of triggers."""
    router = APIRouter(prefix="/api/v1", tags=["stage"], responses=RESPONSES, route_class=StructRoute)

    def shown() -> TriggersShown:
        settings = triggers.settings
        if settings.token:
            settings = msgspec.structs.replace(settings, token=_HIDDEN)
        return TriggersShown(settings, triggers.status())

    @router.get("/triggers")
    def get_triggers() -> TriggersShown:
        """Which triggers are on, and what each received and sent last."""
        return shown()

    @router.patch("/triggers")
    def change_triggers(request: TriggerRequest) -> TriggersShown:
        """Switch triggers on or off, or change them; at once, and also after a restart."""
        changes = request.model_dump(exclude_none=True)
        if changes.get("token") == _HIDDEN:
            del changes["token"]
        for name in ("xml_targets", "webhook_urls"):
            if name in changes:
                changes[name] = tuple(changes[name])
        triggers.change(msgspec.structs.replace(triggers.settings, **changes))
        return shown()

    return router

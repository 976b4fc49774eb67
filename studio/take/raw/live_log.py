"""The live log: every decision of the live stage as an event, applied here both live and in replay.

The live stage changes its pipeline only through `LoggedPipeline`. A replay with the same events
and frames in the same order therefore gives the same poses, bit for bit. docs/formats.md describes the events.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from studio.engine.base.errors import FormatError
from studio.engine.identity.known import KnownPerson
from studio.engine.identity.recognised import Recognised
from studio.engine.model.calibration import (
    Calibration,
    ClockJson,
    Performer,
    performer_from_json,
    performer_to_json,
)
from studio.engine.model.frames import CameraFrame, ClockModel, StepResult
from studio.engine.model.settings.settings import SettingsJson, SolveSettings
from studio.engine.rigid_bodies.markers import MarkersReading
from studio.engine.rigid_bodies.reading import BodyAxes, BodyReading

if TYPE_CHECKING:
    from studio.engine.solve.people import PeoplePipeline


class StartEvent(msgspec.Struct, tag="start", omit_defaults=True):
    """A fresh pipeline; without a calibration there is none until the next start. All are as files hold them.

    `people` are performers known from before (`KnownPerson`), if there are several.
    """

    calibration: dict[str, Any] | None
    settings: SettingsJson
    people: list[dict[str, Any]] = []


class _ClockEvent(msgspec.Struct, kw_only=True):
    """A clock's map, as in `ClockModel`; logs of early versions do not name the clock."""

    camera: str
    clock_id: str | None = None
    offset_ns: int
    drift_ppm: float
    reference_ns: int

    @property
    def model(self) -> ClockModel:
        """The clock's map."""
        return ClockModel(self.offset_ns, self.drift_ppm, self.reference_ns)


class ClockEvent(_ClockEvent, tag="clock", kw_only=True):
    """From now on this maps the camera's clock named `clock_id` to the stage clock."""


class StageClockEvent(_ClockEvent, tag="stage_clock", kw_only=True):
    """The stage clock is that camera's; the map carries the server's clock to it while the camera is away."""


class SettingsEvent(msgspec.Struct, tag="settings"):
    """From now on the pipeline works with these settings, as files hold them."""

    settings: SettingsJson


class CalibrationEvent(msgspec.Struct, tag="calibration"):
    """From now on the pipeline works with this calibration; only early versions wrote it."""

    calibration: dict[str, Any]


class PerformerEvent(msgspec.Struct, tag="performer"):
    """From now on the person of this index is a performer with these proportions, as files hold them."""

    person: int
    proportions: dict[str, Any]


class ExchangedEvent(msgspec.Struct, tag="exchanged"):
    """From now on the identities of two performers, by number, are exchanged."""

    first: int
    second: int


class SkippedEvent(msgspec.Struct, tag="skipped"):
    """The next frame was recorded but withheld from the live pipeline."""

    camera: str
    sequence: int


class TickEvent(msgspec.Struct, tag="tick", omit_defaults=True):
    """The pipeline makes the output frame of this time.

    `pinned` has the positions in which rigid bodies put joints: by performer (`performer_1`) and joint, on the stage
    [m].
    """

    stage_time_ns: int
    pinned: dict[str, dict[str, tuple[float, float, float]]] = {}


class SegmentEvent(msgspec.Struct, tag="segment"):
    """The camera's clock jumped: its frames from `from_sequence` on are stamped by the clock `clock_id`."""

    camera: str
    boot_id: str
    from_sequence: int
    clock_id: str


class JoinedEvent(msgspec.Struct, tag="joined"):
    """A start of a client takes part in the recording: its frames from this sequence on may belong to it."""

    camera: str
    boot_id: str
    from_sequence: int = 0


class RestartEvent(msgspec.Struct, tag="restart"):
    """The server was started again within the take; time for which nothing was recorded [ms]."""

    gap_ms: int


class StoppedEvent(msgspec.Struct, tag="stopped"):
    """The end of the take on the stage clock [ns]; None where the stage had no clock."""

    stage_time_ns: int | None = None


class TimecodeEvent(msgspec.Struct, tag="timecode"):
    """At the time of this event a frame of timecode began: its number since midnight, its rate, its source."""

    frame: int
    rate: str
    source: str


class BodiesEvent(msgspec.Struct, tag="rigid_bodies"):
    """At the time of this event another system reported rigid bodies, in its own axes (`BodyReading`)."""

    axes: BodyAxes
    bodies: list[BodyReading]


class MarkersEvent(msgspec.Struct, tag="markers"):
    """At the time of this event another system reported markers, in its own axes (`MarkersReading`)."""

    axes: BodyAxes
    markers: MarkersReading


KnownEvent = (
    StartEvent
    | ClockEvent
    | StageClockEvent
    | SettingsEvent
    | CalibrationEvent
    | PerformerEvent
    | ExchangedEvent
    | SkippedEvent
    | TickEvent
    | SegmentEvent
    | JoinedEvent
    | RestartEvent
    | StoppedEvent
    | TimecodeEvent
    | BodiesEvent
    | MarkersEvent
)


class UnknownEvent(msgspec.Struct):
    """An event that this version does not know, or that lacks something: only a replay as live needs it."""

    problem: str


LiveEvent = KnownEvent | UnknownEvent

_decoder = msgspec.json.Decoder(KnownEvent)


def read_event(data: bytes) -> LiveEvent:
    """Return an event from its bytes in the log.

    Raises:
        FormatError: it is no JSON.
    """
    try:
        return _decoder.decode(data)
    except msgspec.ValidationError as error:
        return UnknownEvent(f"{error} in {data[:200]!r}")
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FormatError("take.event_not_json", "{error}", error=error) from error


def performer_event(person: int, proportions: Performer) -> PerformerEvent:
    """Return the event that makes a measured stranger a performer."""
    return PerformerEvent(person, {**performer_to_json(proportions)})


def start_event(
    calibration: Calibration | None, settings: SolveSettings, people: Sequence[KnownPerson] = ()
) -> StartEvent:
    """Return the event of a fresh pipeline, from the same numbers live and in replay."""
    placed = None if calibration is None else {**calibration.to_json()}
    return StartEvent(placed, settings.to_json(), [{**one.to_json()} for one in people])


def clock_event(camera: str, clock_id: str, clock: ClockModel) -> ClockEvent:
    """Return the event of a camera's clock."""
    return ClockEvent(camera=camera, clock_id=clock_id, **_numbers(clock))


def stage_clock_event(camera: str, clock_id: str, server_to_stage: ClockModel) -> StageClockEvent:
    """Return the event that names the stage clock's camera and maps the server's clock to it."""
    return StageClockEvent(camera=camera, clock_id=clock_id, **_numbers(server_to_stage))


def _numbers(clock: ClockModel) -> ClockJson:
    drift_ppm = float(clock.drift_ppm)
    if not math.isfinite(drift_ppm):
        raise ValueError(f"a clock's drift of {drift_ppm} ppm cannot be logged")
    return {
        "offset_ns": int(clock.offset_ns),
        "drift_ppm": drift_ppm,
        "reference_ns": int(clock.reference_ns),
    }


def _unreadable(problem: str) -> FormatError:
    return FormatError(
        "take.event_unreadable", "an event of the live log cannot be read: {problem}", problem=problem
    )


class LoggedPipeline:
    """A pipeline that is controlled by the events of the live log and by frames.

    Attributes:
        pipeline: None before a `start` with a calibration.
        settings: those in use; None before the first `start`.
    """

    def __init__(self) -> None:
        self.pipeline: PeoplePipeline | None = None
        self.settings: SolveSettings | None = None
        self._skipped: set[tuple[str, int]] = set()

    def frame(self, frame: CameraFrame) -> list[Recognised]:
        """Give the pipeline a frame, unless a `skipped` event preceded it; return the people recognised in it."""
        key = (frame.camera, frame.sequence)
        if key in self._skipped:
            self._skipped.discard(key)
        elif self.pipeline is not None:
            return self.pipeline.add_frame(frame)
        return []

    def event(self, event: LiveEvent) -> StepResult | None:
        """Perform one event; a `tick` returns what the pipeline made.

        Raises:
            FormatError: an event of a kind that this version does not know, or that lacks something.
        """
        try:
            return self._perform(event)
        except (KeyError, TypeError) as error:
            raise _unreadable(f"{error!r} in {event!r:.200}") from error

    def _perform(self, event: LiveEvent) -> StepResult | None:
        match event:
            case TickEvent():
                return (
                    None if self.pipeline is None else self.pipeline.step(event.stage_time_ns, event.pinned)
                )
            case SkippedEvent():
                self._skipped.add((event.camera, event.sequence))
            case StartEvent():
                self.settings = SolveSettings.from_json(event.settings)
                self.pipeline = None
                if event.calibration is not None:
                    from studio.engine.solve.people import (
                        PeoplePipeline,  # takes long to load: not when the server starts
                    )

                    people = [KnownPerson.from_json(one) for one in event.people]
                    calibration = Calibration.from_json(event.calibration)
                    self.pipeline = PeoplePipeline(calibration, self.settings, people)
            case PerformerEvent() if self.pipeline is not None:
                self.pipeline.add_performer(event.person, performer_from_json(event.proportions))
            case ExchangedEvent() if self.pipeline is not None:
                self.pipeline.exchange(event.first, event.second)
            case SettingsEvent():
                self.settings = SolveSettings.from_json(event.settings)
                if self.pipeline is not None:
                    self.pipeline.set_settings(self.settings)
            case UnknownEvent():
                raise _unreadable(event.problem)
            case CalibrationEvent() if self.pipeline is not None:
                self.pipeline.set_calibration(Calibration.from_json(event.calibration))
            case ClockEvent() if self.pipeline is not None:
                self.pipeline.set_clock(event.camera, event.model)
        return None

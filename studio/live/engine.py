"""The engine thread of the live stage: it owns the pipeline and orders all events.

Frames come from the inbox. Each is recorded, then given to the pipeline, and `Schedule` decides which output
frames are due. Every change of the pipeline is an event of `LoggedPipeline`, which a recording
keeps. All methods except `start`, `put`, `call` and `close` run on that thread.
"""

import logging
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.sentences import say
from studio.engine.identity.known import KnownPerson
from studio.engine.identity.recognised import FIRST
from studio.engine.model.calibration import Performer
from studio.engine.model.frames import StepResult
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.timing.schedule import Schedule
from studio.live import warmup
from studio.live.calibration.calibrator import Calibrator, Outcome
from studio.live.calibration.kept import KeptCalibration
from studio.live.calibration.strangers import Strangers
from studio.live.calibration.tpose import TPoseCapture
from studio.live.cameras.camera import LiveCamera
from studio.live.cameras.previews import Previews
from studio.live.cameras.roster import Roster
from studio.live.figures import PipelineFigures
from studio.live.inbox import Arrived, Call, ClockExchange, Inbox, Item, Left, Reported
from studio.live.latest import Latest
from studio.live.performers.performed import PerformedStage
from studio.live.raw_steps import RawSteps
from studio.live.states import StageStatus
from studio.live.subscribers import Subscribers
from studio.rigid_bodies.incoming import IncomingBodies
from studio.take.raw import live_log as log
from studio.timecode.incoming import IncomingTimecode
from studio.wire import ClockSample, Hello

_log = logging.getLogger(__name__)

MAX_PENDING = 12
"""Most waiting frames of one camera; older ones are recorded but not given to the pipeline."""

MAX_TICKS = 15
"""Most output frames at a time; if more are due, the oldest are left out."""

IDLE_S = 0.01
STATUS_NS = 200_000_000


class Engine(PerformedStage):
    """The live stage's state and the thread that changes it.

    Attributes:
        results: the newest step.
        status: the newest status.
        preparation: of this process for a pipeline.
        timecode, bodies: incoming timecode and rigid bodies.
    """

    def __init__(
        self,
        *,
        clock_ns: Callable[[], int],
        settings: SolveSettings,
        folder: Path,
        calibration: KeptCalibration | None,
        subscribers: Subscribers,
        on_broken: Callable[[], None],
        previews: Previews,
        describe: Callable[["Engine", int], StageStatus],
        timecode: IncomingTimecode,
        bodies: IncomingBodies,
    ) -> None:
        """Start with a calibration or none; `describe` makes the status, at a time of the server's clock [ns]."""
        self._thread = threading.Thread(target=self._run, name="engine", daemon=True)
        self.results: Latest[StepResult] = Latest()
        self.settings = settings
        self.roster = Roster()
        super().__init__()
        self.figures = PipelineFigures()
        self.problem = ""
        self.folder = folder
        self.previews = previews
        self.timecode, self.bodies = timecode, bodies
        self.calibrator = Calibrator(folder / "calibrations", self._computed, previews.floor_views)
        self.tpose = TPoseCapture(self._performer_measured)
        self.strangers = Strangers(self._stranger_measured)
        self.status: StageStatus
        self._clock_ns = clock_ns
        self._subscribers = subscribers
        self._raw_steps = RawSteps()
        self._on_broken = on_broken
        self._describe = describe
        self._inbox = Inbox()
        self._pipeline = log.LoggedPipeline()
        self._schedule = Schedule.of(settings)
        self._status_ns: int | None = None
        self.preparation = warmup.Preparation(lambda: self.put(Call(self._start_missing, Future())))
        self._stopping = False
        if calibration is not None:
            self.use_calibration(calibration.calibration, calibration)
        else:
            self._restart()
        self._refresh()

    # --- from other threads

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def prepare(self, *, now: bool) -> None:
        """Prepare this process for a pipeline now, or once there is a camera or a calibration; returns at once."""
        if now:
            self.put(Call(self.preparation.need, Future()))
        self.put(Call(self.preparation.allow, Future()))

    def put(self, item: Item) -> None:
        """Pass an item to the thread; never waits."""
        self._inbox.put(item)

    def pending(self) -> int:
        """Number of items that wait for the thread."""
        return len(self._inbox)

    def call(self, function: Callable[[], Any]) -> Any:
        """Run the function on the engine thread; return its result or raise its error.

        Raises:
            StudioError: the thread has ended.
        """
        if not self._thread.is_alive():
            raise StudioError("stage.ended", "the live stage has ended; start the studio again")
        future: Future[Any] = Future()
        self.put(Call(function, future))
        return future.result()

    def close(self) -> None:
        """End the thread after all earlier items."""
        if self._thread.is_alive():
            self.call(self._end)
            self._thread.join()

    def _computed(self, outcome: Outcome) -> None:
        self.put(Call(lambda: self._calibrated(outcome), Future()))

    def _performer_measured(self, performer: Performer | None, problem: str) -> None:
        self.put(Call(lambda: self._measured_performer(performer, problem), Future()))

    def _stranger_measured(self, person: int, performer: Performer | None) -> None:
        self.put(Call(lambda: self._measured_stranger(person, performer), Future()))

    # --- the thread

    def _end(self) -> None:
        self._stopping = True

    def _run(self) -> None:
        while not self._stopping:
            items = self._inbox.take(IDLE_S)
            try:
                self._handle(items)
                self._tick()
                self._housekeeping()
            except Exception as error:  # boundary of the thread: the stage continues with a fresh pipeline
                _log.exception("the live pipeline failed and starts afresh")
                self.problem = say(
                    "stage.restarted", "the pipeline failed and was started afresh: {error!r}", error=error
                )
                self.figures.failures += 1
                self._restart(moved=True)

    def _handle(self, items: list[Item]) -> None:
        waiting = Counter(item.frame.camera for item in items if isinstance(item, Arrived))
        for index, item in enumerate(items):
            try:
                self._handle_one(item, waiting)
            except Exception:
                self._inbox.put_back(items[index + 1 :])
                raise

    def _handle_one(self, item: Item, waiting: "Counter[str]") -> None:
        match item:
            case Arrived(frame=frame):
                waiting[frame.camera] -= 1
                self._frame(item, late=waiting[frame.camera] >= MAX_PENDING)
            case ClockExchange(camera=camera, sample=sample) if camera in self.roster.cameras:
                self._measured(self.roster.cameras[camera], sample)
            case Reported(camera=camera, status=status) if camera in self.roster.cameras:
                self.roster.cameras[camera].client = status
                self.roster.cameras[camera].heard_ns = self._clock_ns()
            case Left(camera=camera, reason=reason, error=error) if camera in self.roster.cameras:
                self.roster.cameras[camera].leave(reason, error=error)
            case Call(function=function, future=future):
                self._called(function, future)

    def _called(self, function: Callable[[], Any], future: "Future[Any]") -> None:
        try:
            value = function()
        except Exception as error:  # it belongs to the caller
            future.set_exception(error)
        else:
            self._refresh()
            future.set_result(value)

    # --- cameras

    def join_camera(self, hello: Hello, *, local: bool = False) -> bool:
        """Add a camera; return whether it is the reference."""
        if self.roster.join(hello, keep_clock=self.recording is not None, local=local):
            self._restart(moved=True)
        if self.recording is not None:
            newest = self.roster.cameras[hello.name].newest_sequence
            joined = self.recording.recorder.camera(hello, newest)
            if joined is not None:
                self.recording.note(self._clock_ns(), joined)
        return self.roster.reference == hello.name

    def choose_reference(self, name: str) -> None:
        """Make a camera's clock the stage clock.

        Raises:
            SettingsError: no such camera is connected.
            TakeError: a take is being recorded.
        """
        if self.recording is not None:
            raise TakeError(
                "recording.reference_fixed",
                "a take is being recorded; stop it, then choose another reference camera",
            )
        if self.roster.choose(name):
            self._restart(moved=True)

    def _frame(self, item: Arrived, *, late: bool) -> None:
        frame, recording = item.frame, self.recording
        camera = self.roster.cameras.get(frame.camera)
        if camera is None or (recording is not None and recording.has(item.hello, frame)):
            return
        if item.kept_for:
            self._kept_frame(item, camera)
            return
        if item.hello.boot_id != camera.hello.boot_id:
            return  # another start of the client has taken its name
        before = camera.clock_id
        changed = self.roster.arrived(frame, item.arrival_ns)
        self._note_jump(camera, before)
        self._log_clocks(changed)
        if recording is not None and recording.is_before(item, camera):
            camera.skipped += 1
            return
        usable = self.roster.is_present(frame, self._clock_ns()) and not late
        if not usable:
            camera.skipped += 1
            self._perform(log.SkippedEvent(frame.camera, frame.sequence))
        if recording is not None:
            recording.recorder.frame(item.hello, frame, item.data, item.arrival_ns)
        recognised = self._pipeline.frame(frame)
        if usable:
            camera.took(frame)
            if not frame.others:
                self.calibrator.add(frame)
            self.strangers.add(recognised, item.arrival_ns)
            self.sightings.add(frame, recognised, item.arrival_ns)
            for one in recognised:
                if one.performer == FIRST:
                    self.tpose.add_frame(one.frame)

    def _measured(self, camera: LiveCamera, sample: ClockSample) -> None:
        before = camera.clock_id
        changed = self.roster.measured(camera.name, sample)
        self._note_jump(camera, before)
        self._log_clocks(changed)

    def _note_jump(self, camera: LiveCamera, before: str) -> None:
        if camera.clock_id != before and self.recording is not None:
            boot_id, at = camera.hello.boot_id, camera.step_sequence()
            event = log.SegmentEvent(camera.name, boot_id, at, camera.clock_id)
            self.recording.note(self._clock_ns(), event)

    def _log_clocks(self, cameras: list[LiveCamera]) -> None:
        for camera in cameras:
            clock = self.roster.clock_of(camera.name)
            self._perform(log.clock_event(camera.name, camera.clock_id, clock))
        self._note_stage_clock()

    # --- the pipeline

    def _perform(self, event: log.LiveEvent) -> StepResult | None:
        """Apply an event to the pipeline and record it: the only way to change the pipeline."""
        if self.recording is not None:
            return self.recording.perform(self._clock_ns(), event, self._pipeline.event)
        return self._pipeline.event(event)

    def _restart(self, *, moved: bool = False, people: list[KnownPerson] | None = None) -> None:
        """Start a fresh pipeline. Until it can start at once, there is none, and frames are only recorded.

        Args:
            moved: performers are elsewhere now, by another calibration or clock; they are recognised by their bones.
            people: the performers who stay known; None = all.
        """
        if self.stage_calibration is not None or self.roster.cameras:
            self.preparation.need()
        self._schedule = Schedule.of(self.settings)
        calibration = self.placed_calibration() if warmup.is_ready(self.stage_calibration) else None
        people = self.people() if people is None else people
        if moved:
            people = [one.away() for one in people]
        self.strangers.forget()
        self._perform(log.start_event(calibration, self.settings, people))

    def _start_missing(self) -> None:
        """Start a pipeline where there is none."""
        if self._pipeline.pipeline is None:
            self._restart()

    def _tick(self) -> None:
        if self.stage_calibration is None:
            return
        if self._pipeline.pipeline is None:
            raw = self._raw_steps.step(self.stage_calibration, self.roster, self._clock_ns())
            if raw is not None:
                self._subscribers.tell_raw(raw)
            return
        used = self.settings.camera_names(tuple(self.stage_calibration.cameras))
        now = self.roster.clock.server_to_stage_ns(self._clock_ns())
        due = self._schedule.due(self.roster.newest_stage_ns(used), now)
        self.figures.left_out += max(0, len(due) - MAX_TICKS)
        for stage_time_ns in due[-MAX_TICKS:]:
            begin_ns = self._clock_ns()
            result = self._perform(log.TickEvent(stage_time_ns, self._evidence(stage_time_ns)))
            self.figures.stepped(begin_ns, self._clock_ns())
            if result is not None:
                self.watch.add(result.frame_set)
                now_ns = self._clock_ns()
                if result.performer == FIRST:
                    self.tpose.add_joints(stage_time_ns, result.fused.positions, now_ns)
                strangers = self._pipeline.pipeline.strangers()
                everybody = self.settings.everybody
                self.strangers.update(stage_time_ns, strangers, self.placed_calibration, everybody=everybody)
                if strangers:
                    result = replace(result, strangers=tuple(strangers.values()))
                result = self._with_what_comes_in(result, stage_time_ns, now_ns)
                self.results.publish(result)
                self._subscribers.tell(result)

    def _with_what_comes_in(self, result: StepResult, stage_time_ns: int, now_ns: int) -> StepResult:
        """Return a step with timecode, rigid bodies and markers of its instant; `now_ns` is on the server's clock."""
        now_stage_ns = self.roster.clock.server_to_stage_ns(now_ns)
        if now_stage_ns is None:
            return result
        at_ns = now_ns - (now_stage_ns - stage_time_ns)
        timecode, bodies, markers = (
            self.timecode.at(at_ns),
            self.bodies.at(at_ns),
            self.bodies.markers_at(at_ns),
        )
        if not bodies and timecode is None and markers is None:
            return result
        return replace(result, timecode=timecode, bodies=bodies, markers=markers)

    def _evidence(self, stage_time_ns: int) -> dict[str, dict[str, tuple[float, float, float]]]:
        """Return where rigid bodies put joints at a stage time, by performer and joint [m]."""
        now_ns = self._clock_ns()
        now_stage_ns = self.roster.clock.server_to_stage_ns(now_ns)
        return (
            {} if now_stage_ns is None else self.bodies.evidence_at(now_ns - (now_stage_ns - stage_time_ns))
        )

    def set_settings(self, settings: SolveSettings) -> None:
        """Use other settings from now on.

        Raises:
            SettingsError: the calibration lacks a named camera.
        """
        if self.stage_calibration is not None:
            settings.camera_names(tuple(self.stage_calibration.cameras))
        if (settings.output_hz, settings.ahead_ns) != (self.settings.output_hz, self.settings.ahead_ns):
            self._schedule = Schedule.of(settings)
        self.settings = settings
        self._perform(log.SettingsEvent(settings.to_json()))

    # --- upkeep

    def _housekeeping(self) -> None:
        now = self._clock_ns()
        self.calibrator.update(now, self.roster.reference, self.roster.by_exchange)
        self.tpose.update(now, self.placed_calibration)
        if self.recording is not None and self.recording.recorder.problem and not self.recording.stopping:
            self.recording.stopping = True
            threading.Thread(target=self._on_broken, name="end of recording", daemon=True).start()
        if not self.calibrator.computing and not self.covered():
            recent = (camera.recent for camera in self.roster.connected())
            self.calibrator.start_provisional(recent, now)
        if self._status_ns is None or now - self._status_ns >= STATUS_NS:
            self._refresh()

    def _refresh(self) -> None:
        """Update the status."""
        self._status_ns = self._clock_ns()
        self.refresh_members()
        self.status = self._describe(self, self._status_ns)

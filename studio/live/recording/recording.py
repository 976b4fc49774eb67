"""One recording of the live stage: the recorder, messages to the operator, and the files saved at its end."""

from collections.abc import Callable

from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, ClockModel, StepResult
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.rigid_bodies.known import TakeBodies
from studio.live.cameras.camera import LiveCamera
from studio.live.inbox import Arrived
from studio.live.recording.recorder import Recorder
from studio.live.states import RecordStopped
from studio.take.folder.marker import Restart
from studio.take.folder.meta import TakePerformerMeta
from studio.take.library.live_solve import save_live_solve
from studio.take.raw.live_log import (
    BodiesEvent,
    LiveEvent,
    MarkersEvent,
    StoppedEvent,
    TickEvent,
    TimecodeEvent,
)
from studio.take.raw.membership import BEGIN_NS
from studio.take.rigid_bodies.kept import save_take_bodies
from studio.take.timecode.kept import save_course, stage_course
from studio.wire import Hello
from studio.wire import Recording as RecordingMessage


class LiveRecording:
    """A recording under way; all but `save` belongs to the engine thread.

    Attributes:
        recorder: writes the files.
        began_ns: on the server's clock.
        restarts: of the server, within the take.
        stopping: its end was requested.
        performers, names: who is known on a stage of several; set at its beginning, and again at its end.
        timecode: its readings, each at a time on the server's clock [ns]; added by any thread.
        bodies_came: whether rigid bodies or markers came in.
        known_bodies: what the rigid bodies are; None = none came in.
        server_to_stage: the map to the stage clock at the end; None = the stage had none.
    """

    def __init__(self, recorder: Recorder, began_ns: int, restarts: tuple[Restart, ...] = ()) -> None:
        self.recorder = recorder
        self.began_ns = began_ns
        self.restarts = restarts
        self.stopping = False
        self.performers: list[TakePerformerMeta] = []
        self.names: dict[str, str] = {}
        self.timecode: list[tuple[int, LiveEvent]] = []
        self.bodies_came = False
        self.known_bodies: TakeBodies | None = None
        self.server_to_stage: ClockModel | None = None
        self._ended_ns = began_ns
        self._settings: SolveSettings | None = None
        self._calibration: Calibration | None = None

    @property
    def name(self) -> str:
        """`<session>/<take>`."""
        return str(self.recorder.take.meta["id"])

    def perform(
        self, time_ns: int, event: LiveEvent, action: Callable[[LiveEvent], StepResult | None]
    ) -> StepResult | None:
        """Write an event and apply it; return its result."""
        if not isinstance(event, TickEvent):
            self.recorder.event(time_ns, event)
            return action(event)
        result = action(event)
        self.recorder.tick(time_ns, event, result)
        return result

    def has(self, hello: Hello, frame: CameraFrame) -> bool:
        """Whether the take has this frame already."""
        return self.recorder.has((hello.name, hello.boot_id), frame.sequence)

    def is_before(self, item: Arrived, camera: LiveCamera) -> bool:
        """Whether a frame was taken before the recording began, which only the first ones of a camera can be.

        A clock that jumped may give this result too; a client then keeps the frame, and it is judged again at the
        end.
        """
        key, model = (item.hello.name, item.hello.boot_id), camera.estimator.model
        if item.hello.boot_id != camera.hello.boot_id or model is None or not camera.estimator.exchanged:
            return False
        taken_ns = model.stage_ns(item.frame.device_time_ns)
        return taken_ns < self.began_ns - BEGIN_NS and not self.recorder.begun(key, item.frame.sequence)

    def note(self, time_ns: int, event: LiveEvent) -> None:
        """Write an event that does not concern the pipeline."""
        self.recorder.event(time_ns, event)

    def add_timecode(self, time_ns: int, event: TimecodeEvent) -> None:
        """Write a reading of timecode, from any thread."""
        self.timecode.append((time_ns, event))
        self.recorder.event(time_ns, event)

    def add_bodies(self, time_ns: int, event: BodiesEvent | MarkersEvent) -> None:
        """Write rigid bodies or markers as they came, from any thread."""
        self.bodies_came = True
        self.recorder.event(time_ns, event)

    def end(
        self,
        now_ns: int,
        settings: SolveSettings,
        calibration: Calibration | None,
        stage_time_ns: int | None,
    ) -> None:
        """Store how the recording ended; `calibration` has the final clocks, `stage_time_ns` is the last instant."""
        self._ended_ns, self._settings, self._calibration = now_ns, settings, calibration
        self.recorder.event(now_ns, StoppedEvent(stage_time_ns))

    def save_performers(self) -> None:
        """Store who is known on a stage of several.

        Raises:
            StudioError: the disk refuses.
        """
        if self.performers:
            self.recorder.take.meta["performers"] = self.performers
            self.recorder.take.meta["performer_names"] = self.names
            self.recorder.take.save_meta()

    def save(self) -> RecordStopped:
        """Finish `raw.mcap`, write the live solve and the final calibration; return a summary.

        Raises:
            StudioError: the disk refuses; data written before stays.
        """
        self.recorder.close()
        take = self.recorder.take
        if self._calibration is not None:
            take.add_calibration(self._calibration, use=True)
        self.save_performers()
        course = stage_course(self.timecode, self.server_to_stage)
        if course is not None:
            save_course(take, course)
        if self.known_bodies is not None:
            save_take_bodies(take, self.known_bodies)
        poses = 0
        if self._settings is not None:
            poses = save_live_solve(take, self._settings, self.recorder.frames)
        return RecordStopped(
            session=take.meta["session"],
            take=take.meta["name"],
            seconds=round((self._ended_ns - self.began_ns) * 1e-9, 3),
            frames=self.recorder.frames,
            poses=poses,
            problem=self.recorder.problem,
        )


def recording_message(
    recording: LiveRecording | None, ended: LiveRecording | None = None
) -> RecordingMessage:
    """Return the message to cameras: the take that is being recorded, or the one that has ended."""
    if recording is not None:
        return RecordingMessage(True, recording.name, recording.recorder.take_id, recording.began_ns)
    if ended is not None:
        return RecordingMessage(False, ended.name, ended.recorder.take_id)
    return RecordingMessage(False, "")

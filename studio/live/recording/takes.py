"""Takes on the engine thread: start, resume and end a take, and log the stage clock."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from studio.engine.base.errors import TakeError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel
from studio.engine.model.settings.settings import SolveSettings
from studio.live.cameras.camera import LiveCamera
from studio.live.cameras.clocks import Anchor
from studio.live.cameras.roster import CLOCK_STEP_NS, Roster
from studio.live.inbox import Arrived
from studio.live.recording.recording import LiveRecording
from studio.take.folder.meta import TakePerformerMeta
from studio.take.folder.take import Take
from studio.take.raw import live_log as log
from studio.take.raw.append import RawState


class RecordedTakes(ABC):
    """The part of the engine for recordings; all methods run on its thread.

    Attributes:
        recording: under way, or None.
        ended_problem: why the last one ended by itself.
    """

    roster: Roster
    settings: SolveSettings
    _clock_ns: Callable[[], int]

    def __init__(self) -> None:
        self.recording: LiveRecording | None = None
        self.ended_problem = ""
        self._noted_stage_clock: tuple[Anchor, ClockModel] | None = None

    @abstractmethod
    def _restart(self, *, moved: bool = False) -> None:
        """Start a fresh pipeline; `moved`: performers are elsewhere now, by another calibration or clock."""

    @abstractmethod
    def placed_calibration(self) -> Calibration | None:
        """The calibration in use with every camera's present clock, as stored in a take."""

    @abstractmethod
    def known_performers(self) -> list[TakePerformerMeta]:
        """The performers on a stage of several, as stored in a take."""

    @abstractmethod
    def given_names(self) -> dict[str, str]:
        """The names of performers on a stage of several, as stored in a take."""

    @abstractmethod
    def restore_performers(self, take: Take) -> None:
        """Give performers the names of a resumed take."""

    @abstractmethod
    def _log_clocks(self, cameras: list[LiveCamera]) -> None:
        """Give the clocks of these cameras to the pipeline and the recording."""

    def attach(self, recording: LiveRecording) -> Calibration | None:
        """Start to record, with a fresh pipeline; return the calibration in use, clocks included.

        Raises:
            TakeError: a take is being recorded.
        """
        if self.recording is not None:
            raise TakeError("recording.under_way", "a take is being recorded already; stop it first")
        joined = [recording.recorder.camera(c.hello, c.newest_sequence) for c in self.roster.connected()]
        self.recording, self._noted_stage_clock, self.ended_problem = recording, None, ""
        recording.performers, recording.names = self.known_performers(), self.given_names()
        self._restart()
        self._log_clocks([camera for camera in self.roster.cameras.values() if camera.clock is not None])
        for event in joined:
            if event is not None:
                recording.note(self._clock_ns(), event)
        return self.placed_calibration()

    def resume(self, recording: LiveRecording, state: RawState) -> None:
        """Continue a take that was being recorded when the server ended without warning."""
        if state.settings is not None:
            self.settings = SolveSettings.from_json(state.settings)
        clock = state.last_event(log.StageClockEvent)
        if clock is not None:
            self.roster.restore(Anchor(clock.camera, clock.clock_id or ""), clock.model)
        self.recording, self._noted_stage_clock = recording, None
        recording.timecode = [one for one in state.events if isinstance(one[1], log.TimecodeEvent)]
        recording.bodies_came = any(isinstance(event, log.BodiesEvent) for _, event in state.events)
        self.restore_performers(recording.recorder.take)
        recording.note(self._clock_ns(), log.RestartEvent(recording.restarts[-1].gap_ms))
        self._restart()
        self._note_stage_clock()

    def detach(self) -> LiveRecording:
        """Stop recording and return the recording to save.

        Raises:
            TakeError: nothing is being recorded.
        """
        if self.recording is None:
            raise TakeError("recording.nothing", "nothing is being recorded; start a recording first")
        recording, self.recording = self.recording, None
        now = self._clock_ns()
        stage_ns = self.roster.clock.server_to_stage_ns(now)
        recording.performers, recording.names = self.known_performers(), self.given_names()
        recording.server_to_stage = self.roster.clock.server_to_stage
        recording.end(now, self.settings, self.placed_calibration(), stage_ns)
        return recording

    def _kept_frame(self, item: Arrived, camera: LiveCamera) -> None:
        """Handle a frame that a client has kept. If its take has ended meanwhile, the client is told, and offers it
        again."""
        recording = self.recording
        if recording is None or recording.recorder.take_id != item.kept_for:
            return
        key = (item.hello.name, item.hello.boot_id)
        if recording.is_before(item, camera) or recording.recorder.owed.refuses(key, item.frame.sequence):
            return
        camera.late += 1
        recording.recorder.frame(item.hello, item.frame, item.data, item.arrival_ns, late=True)

    def _note_stage_clock(self) -> None:
        """Record the map from the server's clock to the stage clock, if it has changed."""
        anchor, clock = self.roster.clock.anchor, self.roster.clock.server_to_stage
        if self.recording is None or anchor is None or clock is None:
            return
        now = self._clock_ns()
        old = self._noted_stage_clock
        if old is None or old[0] != anchor or abs(old[1].stage_ns(now) - clock.stage_ns(now)) > CLOCK_STEP_NS:
            self._noted_stage_clock = (anchor, clock)
            self.recording.note(now, log.stage_clock_event(anchor.camera, anchor.clock_id, clock))

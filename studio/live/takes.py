"""What the engine thread does about takes: begin one, go on with one, end one, note the stage clock."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from studio.engine.calibration.result import Calibration
from studio.engine.errors import TakeError
from studio.engine.frames import ClockModel
from studio.engine.settings import SolveSettings
from studio.live import log
from studio.live.camera import LiveCamera
from studio.live.clocks import Anchor
from studio.live.recording import Recording
from studio.live.roster import CLOCK_STEP_NS, Roster
from studio.take.raw_append import RawState


class Takes(ABC):
    """The part of the engine that knows of recordings; all methods run on its thread.

    Attributes:
        recording: under way, or None.
        ended_problem: why the last one ended by itself.
    """

    roster: Roster
    settings: SolveSettings
    _clock_ns: Callable[[], int]

    def __init__(self) -> None:
        self.recording: Recording | None = None
        self.ended_problem = ""
        self._noted_stage_clock: tuple[Anchor, ClockModel] | None = None

    @abstractmethod
    def _restart(self) -> None:
        """Begin with a fresh pipeline."""

    @abstractmethod
    def placed_calibration(self) -> Calibration | None:
        """The calibration in use with every camera's present clock, as a take keeps it."""

    @abstractmethod
    def _log_clocks(self, cameras: list[LiveCamera]) -> None:
        """Let the pipeline and the recording know the clocks of these cameras."""

    def attach(self, recording: Recording) -> Calibration | None:
        """Record from now on, from a fresh pipeline; return the calibration in use, clocks included.

        Raises:
            TakeError: a take is being recorded.
        """
        if self.recording is not None:
            raise TakeError("a take is being recorded already; stop it first")
        for camera in self.roster.connected():
            recording.recorder.camera(camera.hello)
            recording.recorder.starts_after(camera.hello, camera.newest_sequence)
        self.recording, self._noted_stage_clock, self.ended_problem = recording, None, ""
        self._restart()
        self._log_clocks([camera for camera in self.roster.cameras.values() if camera.clock is not None])
        return self.placed_calibration()

    def resume(self, recording: Recording, state: RawState) -> None:
        """Go on with a take that was being recorded when the server ended without warning."""
        if state.settings is not None:
            self.settings = SolveSettings.from_json(state.settings)
        clock = state.last_event("stage_clock")
        if clock is not None:
            self.roster.restore(Anchor(clock["camera"], clock["clock_id"]), log.clock_of(clock))
        self.recording, self._noted_stage_clock = recording, None
        recording.note(self._clock_ns(), {"type": "restart", "gap_ms": recording.restarts[-1].gap_ms})
        self._restart()
        self._note_stage_clock()

    def detach(self) -> Recording:
        """Stop recording and return what is to be saved.

        Raises:
            TakeError: nothing is being recorded.
        """
        if self.recording is None:
            raise TakeError("nothing is being recorded; start a recording first")
        recording, self.recording = self.recording, None
        now = self._clock_ns()
        stage_ns = self.roster.clock.server_to_stage_ns(now)
        recording.end(now, self.settings, self.placed_calibration(), stage_ns)
        return recording

    def _note_stage_clock(self) -> None:
        """Let the recording know how the server's clock maps to the stage clock, where it has changed."""
        anchor, clock = self.roster.clock.anchor, self.roster.clock.server_to_stage
        if self.recording is None or anchor is None or clock is None:
            return
        now = self._clock_ns()
        old = self._noted_stage_clock
        if old is None or old[0] != anchor or abs(old[1].stage_ns(now) - clock.stage_ns(now)) > CLOCK_STEP_NS:
            self._noted_stage_clock = (anchor, clock)
            self.recording.note(now, log.stage_clock_event(anchor.camera, anchor.clock_id, clock))

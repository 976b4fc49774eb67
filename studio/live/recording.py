"""One recording of the live stage: the recorder, what the operator is told of it, and what is saved at its end."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from studio.engine.calibration.result import Calibration
from studio.engine.frames import CameraFrame, StepResult
from studio.engine.settings import SolveSettings
from studio.live.recorder import Recorder
from studio.take.live_solve import save_live_solve
from studio.wire import Hello
from studio.wire import Recording as RecordingMessage


@dataclass(frozen=True)
class Restart:
    """The server was started again within the take: when (UTC), and what was not recorded until then [ms]."""

    at: str
    gap_ms: int


class Recording:
    """A recording under way; all but `save` belongs to the engine thread.

    Attributes:
        recorder: what writes it.
        began_ns: on the server's clock.
        restarts: of the server, within the take.
        stopping: its end was asked for.
    """

    def __init__(self, recorder: Recorder, began_ns: int, restarts: tuple[Restart, ...] = ()) -> None:
        self.recorder = recorder
        self.began_ns = began_ns
        self.restarts = restarts
        self.stopping = False
        self._ended_ns = began_ns
        self._settings: SolveSettings | None = None
        self._calibration: Calibration | None = None

    @property
    def name(self) -> str:
        """`<session>/<take>`."""
        return str(self.recorder.take.meta["id"])

    def perform(
        self, time_ns: int, event: dict[str, Any], action: Callable[[dict[str, Any]], StepResult | None]
    ) -> StepResult | None:
        """Write an event and do it; return what it made."""
        if event["type"] != "tick":
            self.recorder.event(time_ns, event)
            return action(event)
        result = action(event)
        self.recorder.tick(time_ns, event, result)
        return result

    def has(self, hello: Hello, frame: CameraFrame) -> bool:
        """Whether the take has this frame already."""
        return self.recorder.has((hello.name, hello.boot_id), frame.sequence)

    def note(self, time_ns: int, event: dict[str, Any]) -> None:
        """Write an event that the pipeline need not know."""
        self.recorder.event(time_ns, event)

    def end(
        self,
        now_ns: int,
        settings: SolveSettings,
        calibration: Calibration | None,
        stage_time_ns: int | None,
    ) -> None:
        """Note how the recording ended; `calibration` has the final clocks, `stage_time_ns` is the last instant."""
        self._ended_ns, self._settings, self._calibration = now_ns, settings, calibration
        self.recorder.event(now_ns, {"type": "stopped", "stage_time_ns": stage_time_ns})

    def save(self) -> dict[str, Any]:
        """Finish `raw.mcap`, write the live solve and the final calibration; return a summary as JSON.

        Raises:
            StudioError: the disk does not take it; what was written before stays.
        """
        self.recorder.close()
        take = self.recorder.take
        if self._calibration is not None:
            take.add_calibration(self._calibration, use=True)
        poses = 0
        if self._settings is not None:
            poses = save_live_solve(take, self._settings, self.recorder.frames)
        return {
            "session": take.meta["session"],
            "take": take.meta["name"],
            "seconds": round((self._ended_ns - self.began_ns) * 1e-9, 3),
            "frames": self.recorder.frames,
            "poses": poses,
            "problem": self.recorder.problem,
        }


def recording_message(recording: Recording | None, ended: Recording | None = None) -> RecordingMessage:
    """Return what cameras are told: the take that is recorded, or the one that has ended."""
    if recording is not None:
        return RecordingMessage(True, recording.name, recording.recorder.take_id, recording.began_ns)
    if ended is not None:
        return RecordingMessage(False, ended.name, ended.recorder.take_id)
    return RecordingMessage(False, "")

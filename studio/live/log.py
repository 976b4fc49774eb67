"""The live log: every decision of the live stage as an event, performed here both live and in replay.

Since the live stage changes its pipeline only through `LoggedPipeline`, a replay that gives the same events
and frames in the same order gives the same poses, bit for bit. The events are described in docs/formats.md.
"""

import json
from typing import TYPE_CHECKING, Any

from studio.engine.calibration.result import Calibration
from studio.engine.errors import FormatError
from studio.engine.frames import CameraFrame, ClockModel, StepResult
from studio.engine.settings import SolveSettings

if TYPE_CHECKING:
    from studio.engine.pipeline import Pipeline

NOTES = ("segment", "stage_clock", "restart", "stopped")
"""Events that tell of a recording and do nothing to the pipeline."""


def plain(value: Any) -> Any:
    """Return the value as it comes back out of JSON, so that live and replay start from the same numbers."""
    return json.loads(json.dumps(value, allow_nan=False))


def start_event(calibration: Calibration | None, settings: SolveSettings) -> dict[str, Any]:
    """A fresh pipeline; without a calibration there is none until the next start."""
    value = None if calibration is None else calibration.to_json()
    return plain({"type": "start", "calibration": value, "settings": settings.to_json()})


def clock_event(camera: str, clock_id: str, clock: ClockModel) -> dict[str, Any]:
    """From now on the camera's clock, which is the one that `clock_id` names, maps to the stage clock by `clock`."""
    return plain({"type": "clock", "camera": camera, "clock_id": clock_id, **vars(clock)})


def segment_event(camera: str, boot_id: str, from_sequence: int, clock_id: str) -> dict[str, Any]:
    """The camera's clock jumped: its frames from `from_sequence` on are stamped by the clock `clock_id`."""
    kind = {"type": "segment", "camera": camera, "boot_id": boot_id}
    return {**kind, "from_sequence": from_sequence, "clock_id": clock_id}


def stage_clock_event(camera: str, clock_id: str, server_to_stage: ClockModel) -> dict[str, Any]:
    """The stage clock is that camera's; `server_to_stage` carries it on while the camera is away."""
    return plain({"type": "stage_clock", "camera": camera, "clock_id": clock_id, **vars(server_to_stage)})


def clock_of(event: dict[str, Any]) -> ClockModel:
    """Return the clock model of an event that holds one."""
    return ClockModel(event["offset_ns"], event["drift_ppm"], event["reference_ns"])


def settings_event(settings: SolveSettings) -> dict[str, Any]:
    """From now on the pipeline works with these settings."""
    return plain({"type": "settings", "settings": settings.to_json()})


def skipped_event(frame: CameraFrame) -> dict[str, Any]:
    """The frame that follows was recorded but kept from the live pipeline."""
    return {"type": "skipped", "camera": frame.camera, "sequence": frame.sequence}


def tick_event(stage_time_ns: int) -> dict[str, Any]:
    """The pipeline makes the output frame of this time."""
    return {"type": "tick", "stage_time_ns": stage_time_ns}


class LoggedPipeline:
    """A pipeline that is driven by the events of the live log and by frames.

    Attributes:
        pipeline: None before a `start` with a calibration.
        settings: those in use; None before the first `start`.
    """

    def __init__(self) -> None:
        self.pipeline: Pipeline | None = None
        self.settings: SolveSettings | None = None
        self._skipped: set[tuple[str, int]] = set()

    def frame(self, frame: CameraFrame) -> None:
        """Give the pipeline a frame, unless a `skipped` event came before it."""
        key = (frame.camera, frame.sequence)
        if key in self._skipped:
            self._skipped.discard(key)
        elif self.pipeline is not None:
            self.pipeline.add_frame(frame)

    def event(self, event: dict[str, Any]) -> StepResult | None:
        """Perform one event; a `tick` returns what the pipeline made.

        Raises:
            FormatError: an event of a kind that this version does not know, or that lacks something.
        """
        try:
            return self._perform(event)
        except (KeyError, TypeError) as error:
            raise FormatError(
                f"an event of the live log cannot be read: {error!r} in {event!r:.200}"
            ) from error

    def _perform(self, event: dict[str, Any]) -> StepResult | None:
        kind = event["type"]
        if kind == "tick":
            return None if self.pipeline is None else self.pipeline.step(event["stage_time_ns"])
        if kind == "skipped":
            self._skipped.add((event["camera"], event["sequence"]))
        elif kind == "start":
            self.settings = SolveSettings.from_json(event["settings"])
            calibration = event["calibration"]
            self.pipeline = None
            if calibration is not None:
                from studio.engine.pipeline import Pipeline  # takes long to load: not when the server starts

                self.pipeline = Pipeline(Calibration.from_json(calibration), self.settings)
        elif kind == "settings":
            self.settings = SolveSettings.from_json(event["settings"])
            if self.pipeline is not None:
                self.pipeline.set_settings(self.settings)
        elif kind == "clock":
            if self.pipeline is not None:
                self.pipeline.set_clock(event["camera"], clock_of(event))
        elif kind == "calibration":
            if self.pipeline is not None:
                self.pipeline.set_calibration(Calibration.from_json(event["calibration"]))
        elif kind not in NOTES:
            raise FormatError(f"the live log has an event {kind!r} that this version does not know")
        return None

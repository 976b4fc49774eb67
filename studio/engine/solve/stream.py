"""Solves frames as they arrive and returns poses when they are due: a `Pipeline` with its `Schedule`."""

from copy import deepcopy

from studio.engine.edits.pins import Pins
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.pipeline import Pipeline
from studio.engine.solve.timing.schedule import Schedule


class Stream:
    """Solves camera frames one by one, without a clock of its own."""

    def __init__(
        self, calibration: Calibration, settings: SolveSettings, *, pins: Pins | None = None
    ) -> None:
        """Start without any frame; `pins` as for `Pipeline`.

        Raises:
            CalibrationError: the calibration has no performer.
            SettingsError: the settings name a camera that the calibration lacks.
        """
        self.pipeline = Pipeline(calibration, settings, pins=pins)
        self._schedule = Schedule.of(settings)

    def with_pins(self, pins: Pins | None) -> "Stream":
        """Return a stream that continues from the state of this one, with other pins."""
        out = deepcopy(self)
        out.pipeline.set_pins(pins)
        return out

    def add(self, frame: CameraFrame, *, now_stage_ns: int | None = None) -> list[StepResult]:
        """Add a camera's frame; return the output frames that are due now, in order of time.

        Args:
            frame: of any camera; cameras that are not calibrated or not selected are ignored.
            now_stage_ns: the present on the stage clock [ns] for live frames, so that a camera that lags is not
                waited for. None for recorded frames.
        """
        self.pipeline.add_frame(frame)
        return self._step(self._schedule.due(self.pipeline.newest_stage_ns(), now_stage_ns))

    def rest(self) -> list[StepResult]:
        """Return the remaining output frames; call it once, after the last frame."""
        return self._step(self._schedule.rest(self.pipeline.newest_stage_ns()))

    def _step(self, times_ns: list[int]) -> list[StepResult]:
        results = (self.pipeline.step(stage_ns) for stage_ns in times_ns)
        return [result for result in results if result is not None]

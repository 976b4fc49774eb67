"""Calibration and proportions of the live stage, on the engine thread: what is in use, and what replaces it."""

from abc import abstractmethod
from dataclasses import replace
from pathlib import Path

from studio.engine.base.errors import CalibrationError, SettingsError
from studio.engine.calibration.quality.watch import CameraWatch
from studio.engine.calibration.views.seen.known_lens import KnownLenses, check_lenses
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import StepResult
from studio.live.calibration.calibrator import Calibrator, Outcome
from studio.live.calibration.kept import BORROWED, KeptCalibration, save_calibration
from studio.live.calibration.performers import save_profile
from studio.live.calibration.strangers import Strangers
from studio.live.calibration.tpose import TPoseCapture
from studio.live.recording.takes import RecordedTakes
from studio.take.raw import live_log as log


class CalibratedStage(RecordedTakes):
    """The part of the engine for calibrations and performers; all methods run on its thread.

    Attributes:
        stage_calibration: in use; a camera's `clock` is its latency correction (see `calibration.kept`).
        kept: as stored on disk; None for a provisional one, which has one camera only.
        calibrator: makes a calibration of a walk.
        tpose: measures the first performer.
        strangers: measures everybody else.
        watch: detects moved cameras.
    """

    folder: Path
    calibrator: Calibrator
    tpose: TPoseCapture
    strangers: Strangers

    def __init__(self) -> None:
        super().__init__()
        self.kept: KeptCalibration | None = None
        self.stage_calibration: Calibration | None = None
        self.watch = CameraWatch()

    @abstractmethod
    def _perform(self, event: log.LiveEvent) -> StepResult | None:
        """Apply an event to the pipeline and record it."""

    def placed_calibration(self) -> Calibration | None:
        """The calibration in use with every camera's present clock, as stored in a take."""
        if self.stage_calibration is None:
            return None
        cameras = {
            name: replace(camera, clock=self.roster.clock_of(name))
            for name, camera in self.stage_calibration.cameras.items()
        }
        return replace(self.stage_calibration, cameras=cameras)

    def start_calibration(self, seconds: float, height_m: float | None, lenses: KnownLenses) -> None:
        """Start a calibration of all cameras, with the performer's height if known.

        Raises:
            CalibrationError: no camera is connected, or one is under way.
            SettingsError: a lens for a camera that is not connected, or that sees depth.
        """
        if not self.roster.connected():
            raise CalibrationError(
                "calibration.no_camera_to_calibrate",
                "no camera is connected; connect the cameras, then calibrate",
            )
        serials = {camera.name: camera.hello.serial for camera in self.roster.connected()}
        flat = [camera.name for camera in self.roster.connected() if camera.hello.joint_set == "mediapipe"]
        check_lenses(lenses.lenses, flat)
        self.calibrator.start(seconds, self._clock_ns(), serials, height_m, lenses)

    def start_tpose(self, name: str, countdown_s: float) -> None:
        """Start to measure a performer.

        Raises:
            CalibrationError: the stage is not calibrated, or one is under way.
        """
        if self.stage_calibration is None or not self.covered():
            raise CalibrationError(
                "calibration.no_camera_calibrated",
                "no camera is calibrated; calibrate the stage, then measure a performer",
            )
        self.tpose.start(name, countdown_s, self._clock_ns())

    def _measured_performer(self, performer: Performer | None, problem: str) -> None:
        self.tpose.finish(performer, problem)
        if performer is not None:
            if self.tpose.pose.name:
                save_profile(self.folder, self.tpose.pose.name, performer)
            self.use_performer(performer)

    def use_performer(self, performer: Performer) -> None:
        """Use these proportions from now on; a good calibration is stored again with them.

        Raises:
            CalibrationError: the stage is not calibrated.
            StudioError: the disk refuses.
        """
        if self.stage_calibration is None:
            raise CalibrationError(
                "calibration.stage_not_calibrated",
                "the stage is not calibrated; calibrate it, then choose a performer",
            )
        calibration = replace(self.stage_calibration, performer=performer)
        kept = self.kept
        if kept is not None and kept.number != BORROWED:
            kept = save_calibration(self.folder / "calibrations", calibration, kept.devices, kept.created)
        self.use_calibration(calibration, kept, moved=False)

    def use_calibration(
        self, calibration: Calibration | None, kept: KeptCalibration | None, *, moved: bool = True
    ) -> None:
        """Use another calibration, or none, from now on; its clocks are latency corrections.

        `moved`: it places the stage elsewhere.
        """
        self.stage_calibration, self.kept = calibration, kept
        self.watch = CameraWatch()
        cameras = {} if calibration is None else calibration.cameras
        try:
            self.settings.camera_names(tuple(cameras))
        except SettingsError:  # the settings name a camera that is gone
            self.settings = replace(self.settings, cameras="all")
        self.roster.set_corrections({name: camera.clock.offset_ns for name, camera in cameras.items()})
        self._restart(moved=moved)

    def covered(self) -> bool:
        """Whether a connected camera is in the calibration in use."""
        known = () if self.stage_calibration is None else tuple(self.stage_calibration.cameras)
        return any(camera.name in known for camera in self.roster.connected())

    def _calibrated(self, outcome: Outcome) -> None:
        use = self.calibrator.finish(outcome)
        if use and outcome.calibration is not None and not (outcome.provisional and self.covered()):
            self.use_calibration(outcome.calibration, outcome.kept)

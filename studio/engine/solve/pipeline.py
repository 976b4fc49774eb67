"""The pipeline (steps 3 to 9), from camera frames to poses. Live and replay run this same code.

A `Pipeline` is a deterministic state machine without a clock or a random number: the same calls in the same
order give the same poses to the last bit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

import studio.engine.base.blas  # noqa: F401, so that equal input gives equal bits
from studio.engine.base.errors import CalibrationError
from studio.engine.edits.pins import Pins
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame, ClockModel, FrameSet, FusedSkeleton, StepResult
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.rigid_bodies.pins import pinned_by
from studio.engine.solve.body import BodySolver
from studio.engine.solve.conditioning.bone_length import BoneLengthLimit
from studio.engine.solve.conditioning.displacement import DisplacementLimitBefore, limits_m_s
from studio.engine.solve.conditioning.filters import FILTERS
from studio.engine.solve.fusion import make_fusion
from studio.engine.solve.timing.sync import Synchroniser


class Pipeline:
    """Turns camera frames into poses, one output frame per `step`."""

    def __init__(
        self, calibration: Calibration, settings: SolveSettings, *, pins: Pins | None = None
    ) -> None:
        """Start without any frame. `pins`: places of joints that an operator knows.

        Raises:
            CalibrationError: the calibration has no performer.
            SettingsError: the settings name a camera that the calibration lacks.
        """
        self._clocks: dict[str, ClockModel] = {}
        self._pins = pins or None
        self._build(calibration, settings)

    def _build(self, calibration: Calibration, settings: SolveSettings) -> None:
        if calibration.performer is None:
            raise CalibrationError(
                "calibration.no_proportions",
                "the calibration has no performer's proportions; calibrate with a T-pose, or solve "
                "from a recording",
            )
        names = settings.camera_names(tuple(calibration.cameras))
        self._calibration, self._settings = calibration, settings
        cameras = {name: calibration.cameras[name] for name in names}
        self._sync = Synchroniser(cameras, ahead_ns=settings.ahead_ns, performer=calibration.performer)
        for camera, clock in self._clocks.items():
            self._sync.set_clock(camera, clock)
        self._fusion = make_fusion(settings)
        tolerance = settings.bone_length_tolerance
        offsets = calibration.performer.offsets_m
        self._bones = None if tolerance is None else BoneLengthLimit(offsets, tolerance)
        limited = settings.displacement_limit == "before"
        limits = limits_m_s(settings.displacement_limits_m_s)
        self._displacement = DisplacementLimitBefore(limits) if limited else None
        smoothing = settings.smoothing_filter
        self._filter = FILTERS[smoothing[0]]() if smoothing is not None and smoothing[1] == "before" else None
        self._body = BodySolver(calibration.performer, settings)
        self._last_ns: int | None = None

    def stand_beside(self, other: "Pipeline") -> None:
        """Use the floor of another performer's pipeline, until either gets other settings."""
        self._body.stand_beside(other._body)

    def add_frame(self, frame: CameraFrame) -> None:
        """Add a camera's frame; cameras that are not calibrated or not selected are ignored."""
        self._sync.add(frame)

    def set_clock(self, camera: str, clock: ClockModel) -> None:
        """Use this clock for the camera's frames from now on."""
        self._clocks[camera] = clock
        self._sync.set_clock(camera, clock)

    def set_calibration(self, calibration: Calibration) -> None:
        """Use another calibration from now on, and reset the motion."""
        self._clocks = {}
        self._build(calibration, self._settings)

    def set_settings(self, settings: SolveSettings) -> None:
        """Use other settings from now on, and reset the motion."""
        self._build(self._calibration, settings)

    def set_pins(self, pins: Pins | None) -> None:
        """Use other known places of joints from now on."""
        self._pins = pins or None

    def newest_stage_ns(self) -> dict[str, int]:
        """Stage time of each camera's newest frame, for `Schedule.due`."""
        return self._sync.newest_stage_ns()

    def step(
        self, stage_time_ns: int, told: Mapping[str, Sequence[float]] | None = None
    ) -> StepResult | None:
        """Return the output frame at a stage time, or None until a camera has seen the performer.

        A time before that of the last step counts as no time passed.

        Args:
            told: by joint, the place that rigid bodies give it now [m]; not together with edits' pins, which include
                it.
        """
        dt = 0.0 if self._last_ns is None else max(stage_time_ns - self._last_ns, 0) * 1e-9
        self._last_ns = stage_time_ns
        frames = self._sync.frame_set(stage_time_ns)
        if self._pins is not None:
            half = 0.5e9 / self._settings.output_hz
            span_s = (stage_time_ns - half) * 1e-9, (stage_time_ns + half) * 1e-9
            stands = (
                self._pins.stances.at(np.array([stage_time_ns * 1e-9]))[0] if self._pins.stances else None
            )
            touches = self._pins.touches.now(stage_time_ns * 1e-9)
            frames = replace(frames, pinned=self._pins.between(*span_s), touches=touches, stands=stands)
        elif told:
            frames = replace(frames, pinned=pinned_by(told, self._calibration.performer))
        if self._body.fuses:
            fused, pose = self._body.pose_of_cameras(frames, dt)
        else:
            fused = with_pinned(self._conditioned(self._fusion.fuse(frames), dt), frames)
            pose = self._body.pose(fused, frames, dt)
        if pose is None:
            return None
        return StepResult(frames, fused, *pose, configuration=self._body.configuration)

    def _conditioned(self, fused: FusedSkeleton, dt: float) -> FusedSkeleton:
        """Step 6: limits and filters before the solve."""
        joints = fused.positions
        if self._bones is not None:
            joints = self._bones.apply(joints)
        if self._displacement is not None:
            joints = self._displacement.apply(joints, dt)
        if self._filter is not None:
            joints = self._filter.apply(joints, dt)
        unseen = np.isnan(joints[:, 0])
        return fused if joints is fused.positions else replace(
            fused, positions=joints, confidence=np.where(unseen, 0.0, fused.confidence)
        )  # fmt: skip


def with_pinned(fused: FusedSkeleton, frames: FrameSet) -> FusedSkeleton:
    """Return fused joints with pinned ones at their places."""
    if frames.pinned is None:
        return fused
    told, away = frames.pinned.rows(np.nan_to_num(fused.positions))
    unseen, known = np.isnan(fused.positions[:, 0]), told > 0.0
    places = np.where(unseen[:, None], frames.pinned.place_m, fused.positions + away)
    return replace(
        fused,
        positions=np.where(known[:, None], places, fused.positions),
        confidence=np.where(known, 1.0, fused.confidence),
        sigma=np.where(known, np.maximum(told, 1.0) ** -0.5, fused.sigma),
    )

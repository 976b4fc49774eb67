"""One recording of a study and its solves: simulated, calibrated, solved and measured in memory."""

from pathlib import Path
from time import process_time

import numpy as np

from studio.engine.animation.motion.authored import movement
from studio.engine.base import blas  # noqa: F401, one thread per process: there are as many processes as cores
from studio.engine.base.errors import StudioError
from studio.engine.base.files import write_json
from studio.engine.calibration.calibrate import calibrate, with_performer
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.figures.thesis import FIGURES
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.lab.study.plan import Cell, StudyRecording, Variant
from studio.lab.study.results import CellJson
from studio.simulator.joints.seen import see
from studio.simulator.motion import stage_motion, staged
from studio.simulator.rig import standard_rig

MOVED_M = 0.10
"""Smallest effect of a switch on a joint that counts (thesis 5.6.3)."""

KEPT: tuple[str, ...] = (
    *FIGURES, "mpjpe_mm", "mpjpe_root_aligned_mm", "joint_angle_error_deg", "acceleration_error_m_s2", "latency_ms",
    "foot_slide_cm_s", "cleanup_events_per_min", "cleanup_counts", "thesis_joints", "frames",
)  # fmt: skip
"""Stored figures of a solve."""


class StudyStage:
    """A recording with the data that its solves share."""

    def __init__(self, recording: StudyRecording) -> None:
        if recording.content:
            motion, start_s = stage_motion(recording.motion, unit_m=recording.unit_m)
        else:
            motion, start_s = staged(movement(recording.motion))
        assert start_s is not None
        self.start_s = start_s
        self.reference = Reference(motion.times_s(), motion.positions_m)
        rig = standard_rig(recording.cameras)
        self.frames = {
            seen.camera: [
                CameraFrame(
                    seen.camera, i, int(seen.device_time_ns[i]), seen.positions_m[i], seen.confidence[i]
                )
                for i in range(len(seen.taken_s))
            ]
            for seen in see(motion, rig, seed=recording.seed, interference=recording.interference)
        }
        self.problem, self.calibration = _calibrated(self.frames, start_s)
        self._solved: dict[str, Poses] = {}

    def solve(self, variant: Variant, *, keep: bool = False) -> Poses:
        """Return a variant's poses; with `keep` they are cached for comparisons."""
        if variant.name in self._solved:
            return self._solved[variant.name]
        assert self.calibration is not None
        every = (frame for camera in self.frames.values() for frame in camera)
        settings = parse_settings(variant.preset, variant.changes)
        poses = solve_frames(every, self.calibration, settings, start_s=self.start_s)
        if keep:
            self._solved[variant.name] = poses
        return poses


def _calibrated(frames: dict[str, list[CameraFrame]], until_s: float) -> tuple[str, Calibration | None]:
    """Return the reason for a missing calibration, and the calibration; a refused one is not used."""
    try:
        found = calibrate(frames, until_s=until_s)
        if found.refused:
            return f"calibration refused: {'; '.join(found.reasons())}", None
        return "", with_performer(found, frames)
    except StudioError as error:
        return f"no calibration: {error}", None


def run_recording(
    recording: StudyRecording, cells: list[Cell], others: dict[str, Variant], folder: Path
) -> list[str]:
    """Measure cells of one recording and write a file for each; return their keys.

    Args:
        recording: of all cells.
        cells: to solve.
        others: variants by name, for cells that are compared `against` them.
        folder: of the files `<key>.json`.
    """
    began = process_time()
    stage = StudyStage(recording)
    compared = {cell.variant.against for cell in cells}
    done = []
    for cell in cells:
        value: CellJson = {
            "motion": recording.title,
            "cameras": recording.cameras,
            "interference": recording.interference,
            "seed": recording.seed,
            "variant": cell.variant.name,
            "preset": cell.variant.preset,
            "changes": list(cell.variant.changes),
            "problem": stage.problem,
            "cpu_s": 0.0,
        }
        if not stage.problem:
            _measure(value, stage, cell.variant, others, keep=cell.variant.name in compared)
        now = process_time()
        value["cpu_s"], began = round(now - began, 3), now
        write_json(folder / f"{cell.key}.json", value)
        done.append(cell.key)
    return done


def _measure(
    value: CellJson, stage: StudyStage, variant: Variant, others: dict[str, Variant], *, keep: bool
) -> None:
    """Add a variant's figures to its cell, or why there are none."""
    try:
        poses = stage.solve(variant, keep=keep)
        figures = evaluate(poses, stage.reference, start_s=stage.start_s)
    except StudioError as error:
        value["problem"] = f"not solved: {error}"
        return
    value["figures"] = {name: figures[name] for name in KEPT}
    if variant.against is not None:
        beside = stage.solve(others[variant.against], keep=True)
        moved = moved_frames(poses, beside)
        value["moved_10cm"] = [int(moved.sum()), len(moved)]


def moved_frames(poses: Poses, beside: Poses) -> np.ndarray:
    """Return a mask of the frames with a joint at least 10 cm from its place in `beside`, shape (frame_count,)."""
    count = min(poses.frame_count, beside.frame_count)
    distance = np.linalg.norm(
        canonical_positions(poses)[:count] - canonical_positions(beside)[:count], axis=2
    )
    return (distance >= MOVED_M).any(axis=1)

"""The takes of the fixed set, and their figures."""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference.reference import read_reference
from studio.engine.model.frames import CameraFrame
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.offline.tracking import calibrate_take
from studio.simulator.motion import DEMO
from studio.simulator.simulate import simulate_take
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.raw.frames import camera_frames

PRESETS: tuple[str, ...] = ("raw", "thesis", "studio", "finish")

WORSE: dict[str, tuple[Callable[[float], float], float]] = {
    "mpjpe_mm": (abs, 0.2),
    "mpjpe_root_aligned_mm": (abs, 0.2),
    "acceleration_error_m_s2": (abs, 0.2),
    "joint_angle_error_deg": (abs, 0.1),
    "absolute_difference_cm": (abs, 0.05),
    "shortest_distance_cm": (abs, 0.05),
    "spike_difference": (abs, 0.17),
    "deviations": (abs, 0.17),
    "latency_ms": (abs, 1.0),
    "foot_slide_cm_s": (abs, 0.2),
    "foot_height_error_cm": (abs, 0.1),
    "contact_recall": (lambda value: -value, 0.02),
    "uncertainty_coverage": (lambda value: abs(value - 0.9), 0.01),
    "cleanup_events_per_min": (abs, 9.0),
}
"""Figure -> a measure of how bad it is, larger is worse, and the least difference that is reported: one event of a
few seconds, one spike or deviation in six curves, and what the arithmetic of other processors may change."""


@dataclass(frozen=True)
class Case:
    """One take: a recording of the outside data, or a simulated one.

    Attributes:
        recording: folder below the outside data; None = the embedded performer.
        motion: the same motion as BVH below the outside data, from which `noise` makes takes; None as above.
        cameras: number of cameras.
        skip_s, seconds: which part after the calibration is solved.
    """

    recording: str | None
    motion: str | None
    cameras: int
    skip_s: float
    seconds: float


CASES: dict[str, Case] = {
    "demo_2": Case(None, None, 2, 8.0, 6.0),
    "jumps_2": Case("noisy_joints/jumps_2_cameras", "mocap/49_02.bvh", 2, 1.0, 6.0),
    "ballet_4": Case("noisy_joints/ballet_4_cameras", "mocap/05_06.bvh", 4, 0.0, 6.0),
}

CMU_UNIT_M = 0.056444


def figures(case: Case, data: Path | None) -> dict[str, dict[str, float]]:
    """Return the figures of the case, by preset and name; `data`: folder of the outside recordings."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "take"
        if case.recording is None:
            return _measured(case, _simulated(DEMO, case, out, seed=1), out.with_name("take.truth.csv"))
        assert data is not None
        take = import_recording(data / case.recording, out)
        return _measured(case, take, data / case.recording / "truth" / "joints.csv")


def seeded_figures(case: Case, data: Path, seed: int) -> dict[str, dict[str, float]]:
    """Return the figures of the case's motion under simulated noise of a seed."""
    motion = DEMO if case.motion is None else str(data / case.motion)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "take"
        return _measured(case, _simulated(motion, case, out, seed=seed), out.with_name("take.truth.csv"))


def _simulated(motion: str, case: Case, out: Path, *, seed: int) -> Take:
    unit_m = None if motion == DEMO else CMU_UNIT_M
    simulate_take(motion, out, cameras=case.cameras, seed=seed, unit_m=unit_m)
    return Take.open(out)


def _measured(case: Case, take: Take, truth: Path) -> dict[str, dict[str, float]]:
    calibration = calibrate_take(take)
    assert not calibration.refused, calibration.reasons()
    start_s = float(take.meta["calibration_s"]) + case.skip_s
    end_s = start_s + case.seconds
    frames = {
        name: [f for f in some if calibration.cameras[name].clock.stage_ns(f.device_time_ns) < end_s * 1e9]
        for name, some in camera_frames(take.raw_path).items()
    }
    reference = read_reference(truth)
    out = {}
    for preset in PRESETS:
        every: Iterator[CameraFrame] = (frame for some in frames.values() for frame in some)
        poses = solve_frames(every, calibration, parse_settings(preset, ()), start_s=start_s)
        found: dict[str, Any] = evaluate(poses, reference, start_s=start_s)
        out[preset] = {name: float(found[name]) for name in WORSE if found[name] is not None}
    return out

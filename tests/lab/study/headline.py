"""Why preset `finish` with two cameras does not halve the error of one camera: the same solve with more given.

python -m tests.lab.study.headline [--seeds N]

The thesis's four movements, wrist relative to chest. A simulated performer's joints are detected next to the
anatomical centres, with the same offsets in every frame and camera (SD 1 cm per axis); a shorter or longer bone
explains them equally well. So there is a row for each thing that no camera sees, given from the truth, and
`detected`: the detected points themselves without any noise.
"""

import argparse
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.authored import MOVEMENTS, movement
from studio.engine.base.geometry import fit_rigid, transform_points
from studio.engine.calibration.calibrate import with_performer
from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.figures.thesis import absolute_difference_cm, shortest_distance_cm
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import ClockModel
from studio.engine.model.joints import INDEX, JOINT_COUNT, MEASURED_JOINTS
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.lab.study.cell import StudyStage
from studio.lab.study.plan import StudyRecording
from studio.simulator.clock import SimulatedClock, random_clock
from studio.simulator.joints import seen
from studio.simulator.joints.bone_frames import bone_frames
from studio.simulator.joints.noisy_joints import anatomical_offsets
from studio.simulator.motion import staged
from studio.simulator.rig import standard_rig

RATE_HZ = 60.0
TOWARDS_CAMERA_M = 0.03
ROWS = ("finish", "true places", "true proportions", "both", "detected", "no offsets")
"""Rows: `finish` as it is; true cameras and clocks; true lengths of bones; both; the detected points without noise; a
performer who is detected at the anatomical centres."""

Figures = tuple[float, float]
"""Absolute difference and shortest distance [cm]."""


def figures(motion: str, seed: int) -> dict[str, Figures]:
    """Return the figures of one movement and seed by row, with `raw`, one camera, for comparison; empty if the
    calibration is refused."""
    one, two = (StudyStage(StudyRecording(motion, "", count, count > 1, seed)) for count in (1, 2))
    if one.calibration is None or two.calibration is None or two.calibration.performer is None:
        return {}
    height_m = two.calibration.performer.height_m
    body = Performer(height_m, staged(movement(motion))[0].offsets_m, soles_measured=False)
    placed = replace(two.calibration, cameras=_true_cameras(len(two.frames), seed))
    whole = with_performer(replace(two.calibration, performer=body), two.frames)
    out = {
        "raw": _solved(one, one.calibration, "raw"),
        "finish": _solved(two, two.calibration, "finish"),
        "true places": _solved(two, placed, "finish"),
        "true proportions": _solved(two, whole, "finish"),
        "both": _solved(two, with_performer(replace(placed, performer=body), two.frames), "finish"),
        "detected": detected(motion, seed),
    }
    with patch.object(seen, "anatomical_offsets", lambda rng: np.zeros((JOINT_COUNT, 3))):
        exact = StudyStage(StudyRecording(motion, "", 2, True, seed))
    if exact.calibration is not None:
        out["no offsets"] = _solved(exact, exact.calibration, "finish")
    return out


def detected(motion: str, seed: int) -> Figures:
    """Return the figures of the points that cameras detect, without any noise, aligned as a solve is."""
    body, start_s = staged(movement(motion))
    times = np.arange(start_s or 0.0, body.duration_s, 1.0 / RATE_HZ)
    true = np.stack([body.at(t) for t in times])
    anatomy = anatomical_offsets(np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0]))
    points = true + np.einsum("fjab,jb->fja", bone_frames(true, body.offsets_m), anatomy)
    measured = [INDEX[name] for name in MEASURED_JOINTS]
    points = transform_points(
        fit_rigid(points[:, measured].reshape(-1, 3), true[:, measured].reshape(-1, 3)), points
    )
    wrists = [INDEX["left_wrist"], INDEX["right_wrist"]]

    def curves(joints: NDArray[np.float64]) -> NDArray[np.float64]:
        return (joints[:, wrists] - joints[:, [INDEX["chest"]]]).transpose(1, 0, 2)

    return (
        absolute_difference_cm(curves(points), curves(true)),
        shortest_distance_cm(curves(points), curves(true)),
    )


def _solved(stage: StudyStage, calibration: Calibration, preset: str) -> Figures:
    every = (frame for camera in stage.frames.values() for frame in camera)
    poses = solve_frames(every, calibration, parse_settings(preset, ()), start_s=stage.start_s)
    found = evaluate(poses, stage.reference, start_s=stage.start_s)
    return found["absolute_difference_cm"], found["shortest_distance_cm"]


def _true_cameras(count: int, seed: int) -> dict[str, CameraCalibration]:
    """The rig's cameras at their true places, with the clocks that `seen.see` gives them."""
    rig = standard_rig(count)
    streams = np.random.SeedSequence(seed).spawn(1 + count)[1:]
    out = {}
    for k, (camera, stream) in enumerate(zip(rig, streams, strict=True)):
        clock = random_clock(np.random.default_rng(stream)) if k > 0 else SimulatedClock()
        back = ClockModel(
            offset_ns=round(-clock.offset_s * 1e9),
            drift_ppm=(1.0 / (1.0 + clock.drift_ppm * 1e-6) - 1.0) * 1e6,
            reference_ns=round(clock.offset_s * 1e9),
        )
        out[camera.name] = CameraCalibration(camera.T_stage_camera, clock=back, depth_bias_m=TOWARDS_CAMERA_M)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.lab.study.headline", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    args = parser.parse_args()
    found = [figures(motion, seed) for seed in range(args.seeds) for motion in MOVEMENTS]
    found = [one for one in found if "no offsets" in one]
    raw = np.mean([one["raw"] for one in found], axis=0)
    print(f"{len(found)} recordings; raw, 1 camera: {raw[0]:.2f} and {raw[1]:.2f} cm")
    for row in ROWS:
        mean = np.mean([one[row] for one in found], axis=0)
        change = 100.0 * (mean / raw - 1.0)
        print(f"{row:17s} {mean[0]:.2f} cm {change[0]:+.1f} %   {mean[1]:.2f} cm {change[1]:+.1f} %")


if __name__ == "__main__":
    main()

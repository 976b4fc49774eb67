"""What phones' pictures cost: a rolling shutter, and a frame rate that falls from 30 to 12 Hz and back.

The same motions, noise and true cameras, with and without these effects. Run as a program, it prints the errors.
"""

import argparse
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.joints import (
    INDEX,
    JOINT_COUNT,
    MEASURED_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
    to_canonical,
)
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.take import solve_frames
from studio.simulator.landmarks.body import stature_m
from studio.simulator.landmarks.seen import SeenLandmarks, see_landmarks
from studio.simulator.landmarks.timing import PictureTiming
from studio.simulator.motion import stage_motion
from studio.simulator.rig import standard_rig

MEASURED = [INDEX[name] for name in MEASURED_JOINTS if name != "hips"]
READOUT_S = 0.025
TIMINGS = {
    "all rows at once, 30 Hz": PictureTiming(),
    "rows in 25 ms": PictureTiming(readout_s=READOUT_S),
    "30 to 12 Hz and back": PictureTiming(slow_s=tuple((k + 2.0, k + 6.0) for k in range(0, 600, 8))),
}
_UNSEEN = np.full((JOINT_COUNT, 3), np.nan)


def frames_of(camera: SeenLandmarks) -> list[CameraFrame]:
    """A camera's frames, on the stage clock."""
    out = []
    for k, (time_s, picture) in enumerate(zip(camera.taken_s, camera.pictures, strict=True)):
        if picture is None:
            continue
        flat = np.column_stack([picture.pixels, np.zeros(len(picture.pixels))])
        joints, sure = to_canonical("mediapipe", flat, picture.visibility)
        world_m, _ = to_canonical("mediapipe", picture.world_m, picture.visibility)
        seen = PictureJoints(camera.lens.width, camera.lens.height, joints[:, :2], world_m)
        out.append(CameraFrame(camera.camera, k, round(time_s * 1e9), _UNSEEN, sure, picture=seen))
    return out


def seen_by(motion: CanonicalMotion, cameras: int, seed: int, timing: PictureTiming) -> list[SeenLandmarks]:
    """What a number of cameras see of a motion."""
    return list(see_landmarks(motion, standard_rig(cameras), seed=seed, timing=timing))


def errors_mm(
    motion: CanonicalMotion, seen: list[SeenLandmarks], solve: str, *, readout_ms: float = 0.0
) -> NDArray[np.float64]:
    """Errors of the joints with true cameras and the true body, shape (frame_count, 14).

    Args:
        seen: of all cameras (`seen_by`).
        solve: a preset; readout_ms: the readout time that it assumes.
    """
    rig = standard_rig(len(seen))
    calibrated, frames = dict[str, CameraCalibration](), list[CameraFrame]()
    for place, camera in zip(rig, seen, strict=True):
        calibrated[camera.camera] = CameraCalibration(
            place.T_stage_camera, lens=camera.lens, readout_ms=readout_ms
        )
        frames += frames_of(camera)
    performer = Performer(stature_m(motion.offsets_m), motion.offsets_m, soles_measured=True)
    calibration = Calibration(rig[0].name, calibrated, performer, floor_given=True)
    poses = solve_frames(frames, calibration, preset(solve))
    true_m = np.array([motion.at(float(t)) for t in poses.time_s])
    off = poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX] - true_m
    return np.asarray(1e3 * np.linalg.norm(off[:, MEASURED], axis=2))


def main() -> None:
    """Print the errors by motion, cameras and timing."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.phones", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("--motions", nargs="*", default=["02_01", "02_03", "05_06", "49_04"])
    chosen = parser.parse_args()
    for name in chosen.motions:
        motion, _ = stage_motion(chosen.data / "mocap" / f"{name}.bvh", calibration=False)
        for cameras in (2, 4):
            for title, timing in TIMINGS.items():
                told, seen = [], seen_by(motion, cameras, 1, timing)
                for solve in ("studio", "finish"):
                    errors = errors_mm(motion, seen, solve)
                    told.append(
                        f"{solve} {errors.mean():5.1f} mm, 95 % under {np.percentile(errors, 95):5.1f}"
                    )
                print(f"{name}, {cameras} cameras, {title:24s}: {'; '.join(told)}", flush=True)


if __name__ == "__main__":
    main()

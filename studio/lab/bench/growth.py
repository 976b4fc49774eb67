"""Growth of time and memory: live pipeline over cameras and joints, whole take over its length."""

import multiprocessing
import time
from typing import TypedDict

from studio import wire
from studio.engine.base.system import one_core, peak_memory_bytes
from studio.engine.model.joints import JOINT_SETS
from studio.engine.model.settings.settings import preset
from studio.engine.whole_take.take import solve_frames
from studio.lab.bench import stages
from studio.simulator.demo import make_stage
from studio.take.raw.frames import camera_frame

CAMERAS = tuple(range(1, 9))
TAKES_S = (5.0, 10.0, 20.0, 40.0)
JOINT_SET = "kinect-v2"
"""The joints of the cameras whose number grows: 25."""


class Growth(TypedDict):
    """Timing of the live pipeline by number of cameras and of joints, and of a take's solve by its length [s]."""

    pipeline_by_cameras: dict[str, stages.StageTiming]
    pipeline_by_joints: dict[str, stages.StageTiming]
    take_by_seconds: dict[str, dict[str, float]]


def growth(frames: int) -> Growth:
    """Return the growth of the live pipeline and of a take's solve, as in `bench --growth --json`.

    Args:
        frames: output frames per point; takes have their own lengths.
    """
    seconds = frames / stages.SETTINGS.output_hz
    with one_core():
        by_cameras = {
            str(count): stages.pipeline(make_stage(seconds, cameras=count, joint_set=JOINT_SET))[0]
            for count in CAMERAS
        }
        by_joints = {
            str(len(joints)): stages.pipeline(make_stage(seconds, joint_set=name))[0]
            for name, joints in sorted(JOINT_SETS.items(), key=lambda one: len(one[1]))
        }
    lengths = TAKES_S if frames >= 300 else TAKES_S[:2]
    return {
        "pipeline_by_cameras": by_cameras,
        "pipeline_by_joints": by_joints,
        "take_by_seconds": {f"{length:g}": apart(length) for length in lengths},
    }


def apart(seconds: float) -> dict[str, float]:
    """Return time and peak memory of solving a take of this length with preset `finish`, in a separate process."""
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        return pool.apply(whole_take, (seconds,))


def whole_take(seconds: float) -> dict[str, float]:
    """Solve a take of two cameras; return the time and this process's peak memory."""
    with one_core():
        stage = make_stage(seconds)
        frames = [
            camera_frame(camera, stage.joint_set, message)
            for camera, data in stage.messages
            if isinstance(message := wire.decode(data), wire.SkeletonFrame)
        ]
        before = peak_memory_bytes()
        begin = time.perf_counter()
        poses = solve_frames(frames, stage.calibration, preset("finish"))
        took_s = time.perf_counter() - begin
    return {
        "solve_s": took_s,
        "frames_per_second": poses.frame_count / took_s,
        "peak_memory_mb": peak_memory_bytes() / 2**20,
        "peak_memory_before_mb": before / 2**20,
    }

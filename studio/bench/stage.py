"""The input of the benchmark: two cameras that watch the embedded performer, as bytes on the wire."""

from dataclasses import dataclass

import numpy as np

from studio import wire
from studio.camera.simulator.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.camera.simulator.rig import standard_rig
from studio.engine.calibration.result import Calibration, CameraCalibration, Performer
from studio.engine.motion.authored import demo_motion

JOINT_SET = "canonical"
START_S = 3.0
"""Where in the performance the benchmark begins: after the T-pose."""


@dataclass(frozen=True)
class Stage:
    """A calibrated stage and its cameras' messages, (name, bytes of a `SkeletonFrame`), in time order."""

    calibration: Calibration
    messages: list[tuple[str, bytes]]


def make_stage(seconds: float) -> Stage:
    """Return the simulated stage of two cameras, calibrated truly, with the noise of `noisy-joints`."""
    rng = np.random.default_rng(1)
    motion = demo_motion()
    height = float(motion.positions_m[0, :, 2].max()) + 0.12
    rig = standard_rig(2)
    cameras = {camera.name: CameraCalibration(camera.T_stage_camera) for camera in rig}
    calibration = Calibration(rig[0].name, cameras, Performer(height, motion.offsets_m))
    hands = [wire.HandState(side, "shape", 0.8) for side in ("left", "right")]
    anatomy = anatomical_offsets(rng)
    messages: list[tuple[int, str, bytes]] = []
    for i, camera in enumerate(rig):
        times = np.arange(round(seconds * FRAMES_PER_SECOND)) / FRAMES_PER_SECOND + 0.011 * i
        joints = np.stack([motion.at((START_S + t) % motion.duration_s) for t in times])
        seen = NoisyJoints(camera.T_stage_camera, motion.offsets_m, anatomy, rng).see_all(joints)
        for k, (time_s, positions, confidence) in enumerate(zip(times, *seen, strict=True)):
            frame = wire.skeleton_frame(k, round(time_s * 1e9), positions, confidence, hands)
            messages.append((frame.device_time_ns, camera.name, wire.encode(frame)))
    messages.sort()
    return Stage(calibration, [(name, data) for _, name, data in messages])

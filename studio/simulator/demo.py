"""Input of the benchmark: cameras that watch the embedded performer, as bytes on the wire."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.animation.motion.authored import demo_motion
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.joints import JOINT_SETS, to_canonical
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import MAX_CAMERAS, RigCamera, look_at, standard_rig

START_S = 3.0
"""Start of the benchmark in the performance, after the T-pose."""


@dataclass(frozen=True)
class DemoStage:
    """A calibrated stage and its cameras' messages, (name, bytes of a `SkeletonFrame`), in time order.

    Attributes:
        joint_set: of all cameras.
    """

    calibration: Calibration
    joint_set: str
    messages: list[tuple[str, bytes]]

    @property
    def performer(self) -> Performer:
        """The performer of the calibration, which a stage made here always has."""
        assert self.calibration.performer is not None
        return self.calibration.performer


APART = np.array([1.6, 0.0, 0.0])
"""Vector from one performer to the next, side by side [m]."""


def make_stage(
    seconds: float, *, cameras: int = 2, joint_set: str = "canonical", performers: int = 1
) -> DemoStage:
    """Return the simulated stage, with its true calibration and the noise of `noisy-joints`.

    Args:
        seconds: duration.
        cameras: number of cameras.
        joint_set: of the cameras; device joints without a canonical one lie at the hips.
        performers: number; all move alike, side by side towards +x, without occlusion.
    """
    rng = np.random.default_rng(1)
    motion = demo_motion()
    height = float(motion.positions_m[0, :, 2].max()) + 0.12
    rig = standard_rig(cameras) if cameras <= MAX_CAMERAS else _ring(cameras)
    placed = {camera.name: CameraCalibration(camera.T_stage_camera) for camera in rig}
    calibration = Calibration(rig[0].name, placed, Performer(height, motion.offsets_m))
    hands = [wire.HandState(side, "shape", 0.8) for side in ("left", "right")]
    anatomy, device = anatomical_offsets(rng), _canonical_of(joint_set)
    messages: list[tuple[int, str, bytes]] = []
    for i, camera in enumerate(rig):
        times = np.arange(round(seconds * FRAMES_PER_SECOND)) / FRAMES_PER_SECOND + 0.011 * i
        joints = np.stack([motion.at((START_S + t) % motion.duration_s) for t in times])
        seen = [
            NoisyJoints(camera.T_stage_camera, motion.offsets_m, anatomy, rng).see_all(joints + who * APART)
            for who in range(performers)
        ]
        for k, time_s in enumerate(times.tolist()):
            bodies = [
                wire.skeleton_frame(
                    k, round(time_s * 1e9), positions[k][device], confidence[k][device], hands, body=who
                )
                for who, (positions, confidence) in enumerate(seen)
            ]
            frame = wire.with_others(bodies[0], bodies[1:]) if performers > 1 else bodies[0]
            messages.append((frame.device_time_ns, camera.name, wire.encode(frame)))
    messages.sort()
    return DemoStage(calibration, joint_set, [(name, data) for _, name, data in messages])


def _ring(cameras: int) -> tuple[RigCamera, ...]:
    """Return a ring of cameras at alternating heights."""
    rig = []
    for k in range(cameras):
        angle = 2 * np.pi * k / cameras
        position = np.array([3.5 * np.sin(angle), -3.5 * np.cos(angle), (1.0, 1.6)[k % 2]])
        rig.append(RigCamera(f"camera_{k}", look_at(position, np.array([0.0, 0.0, 1.0]))))
    return tuple(rig)


def _canonical_of(joint_set: str) -> NDArray[np.int64]:
    """Return the canonical joint of each device joint; the hips if there is none."""
    count = len(JOINT_SETS[joint_set])
    numbers = np.repeat(np.arange(count, dtype=float)[:, None], 3, axis=1)
    found = to_canonical(joint_set, numbers, np.ones(count))[0][:, 0]
    out = np.zeros(count, dtype=np.int64)
    for canonical, device in enumerate(found):
        if np.isfinite(device) and device == int(device):
            out[int(device)] = canonical
    return out

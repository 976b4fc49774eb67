"""Many walks under the noise contract: calibrations are right or refused; no wrong one is accepted."""

import numpy as np
import pytest

from studio.engine.animation.motion.authored import calibration_motion
from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.calibration.calibrate import calibrate
from studio.engine.model.frames import CameraFrame
from studio.simulator.clock import SimulatedClock, jitter_s, random_clock
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import standard_rig
from tests.engine.calibration.scoring import clock_error_ms, transform_error

BARS = {2: (0.015, 0.5, 19), 3: (0.015, 0.5, 19), 4: (0.02, 0.8, 18)}
"""Cameras -> largest error over the stage [m] and in angle [degrees], and how many of 20 walks must meet it."""


def walk(seed: int, cameras: int):
    """Return frames by camera, true poses and true clocks of the walk of `studio simulate`."""
    motion = calibration_motion(AUTHORED_OFFSETS)
    rig = standard_rig(cameras)
    performer, *streams = np.random.SeedSequence(seed).spawn(1 + cameras)
    anatomy = anatomical_offsets(np.random.default_rng(performer))
    frames, clocks = {}, {}
    for k, (camera, stream) in enumerate(zip(rig, streams, strict=True)):
        rng = np.random.default_rng(stream)
        clock = random_clock(rng) if k else SimulatedClock()
        count = int((motion.duration_s - 0.3) * FRAMES_PER_SECOND)
        start = 0.2 + rng.uniform(0, 1 / FRAMES_PER_SECOND)
        taken = start + np.arange(count) / FRAMES_PER_SECOND + [jitter_s(rng) for _ in range(count)]
        tracker = NoisyJoints(camera.T_stage_camera, motion.offsets_m, anatomy, rng)
        positions, confidence = tracker.see_all(np.stack([motion.at(t) for t in taken]))
        stamps = np.round(clock.device_s(taken) * 1e9).astype(np.int64)
        frames[camera.name] = [
            CameraFrame(camera.name, i, int(stamps[i]), positions[i], confidence[i]) for i in range(count)
        ]
        clocks[camera.name] = clock
    return frames, {camera.name: camera.T_stage_camera for camera in rig}, clocks


def is_right(seed: int, cameras: int) -> bool | None:
    """Whether a walk's calibration is right, with clocks within 8 ms; None if it is refused.

    Fails if a camera's place is wrong but accepted.
    """
    frames, truth, clocks = walk(seed, cameras)
    found = calibrate(frames)
    if found.refused:
        return None
    metres, degrees, _ = BARS[cameras]
    late_ms: list[float] = []
    for camera in list(frames)[1:]:
        error = transform_error(found, truth, camera)
        assert error.rms_m <= metres, (seed, camera)
        assert error.angle_deg <= degrees, (seed, camera)
        offset_s, drift = clocks[camera].offset_s, clocks[camera].drift_ppm * 1e-6
        late_ms += [clock_error_ms(found, camera, stage_s, offset_s, drift) for stage_s in (1.0, 33.0)]
    return max(late_ms) <= 8.0


@pytest.mark.parametrize("cameras", [2, *(pytest.param(n, marks=pytest.mark.long) for n in (3, 4))])
def test_one_walk(cameras):
    """The recordings with three and four cameras have the same bars."""
    assert is_right(7, cameras)


@pytest.mark.long
@pytest.mark.parametrize("cameras", BARS)
def test_twenty_walks(cameras):
    assert sum(is_right(seed, cameras) is True for seed in range(20)) >= BARS[cameras][2]

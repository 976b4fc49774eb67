"""Frames of simulated cameras: skeletons with a tracker's errors, on their own clocks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.simulator.clock import SimulatedClock, random_clock
from studio.simulator.instants import instants
from studio.simulator.joints.interference import disturb
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import RigCamera


@dataclass(frozen=True)
class SeenJoints:
    """All frames of one camera.

    Attributes:
        camera: its name.
        taken_s: true capture time of each frame [s], shape (F,).
        device_time_ns: capture times on the camera's clock, shape (F,).
        positions_m: joints in the camera frame, shape (F, 21, 3); NaN = unseen.
        confidence: shape (F, 21).
    """

    camera: str
    taken_s: NDArray[np.float64]
    device_time_ns: NDArray[np.int64]
    positions_m: NDArray[np.float64]
    confidence: NDArray[np.float64]


def see(
    motion: CanonicalMotion, rig: tuple[RigCamera, ...], *, seed: int, interference: bool = False
) -> Iterator[SeenJoints]:
    """Yield each camera's frames with the noise of `noisy_joints`; the same seed gives the same frames.

    Args:
        motion: on the stage.
        rig: the cameras; the first one's clock is the stage clock.
        seed: of all noise and clocks.
        interference: the cameras disturb each other, see `interference`.
    """
    performer, *streams = np.random.SeedSequence(seed).spawn(1 + len(rig))
    anatomy = anatomical_offsets(np.random.default_rng(performer))
    for k, (camera, stream) in enumerate(zip(rig, streams, strict=True)):
        rng = np.random.default_rng(stream)
        clock = random_clock(rng)
        clock = SimulatedClock() if k == 0 else clock
        taken = instants(rng, motion.duration_s, FRAMES_PER_SECOND)
        tracker = NoisyJoints(camera.T_stage_camera, motion.offsets_m, anatomy, rng)
        positions, confidence = tracker.see_all(np.stack([motion.at(t) for t in taken]))
        if interference:
            own = np.random.default_rng(stream.spawn(1)[0])
            positions, confidence = disturb(positions, confidence, len(rig), own)
        stamps = np.round(clock.device_s(taken) * 1e9).astype(np.int64)
        yield SeenJoints(camera.name, taken, stamps, positions, confidence)

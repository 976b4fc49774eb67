"""Frames of simulated cameras without depth: landmarks with a pose network's errors, on their own clocks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import invert_transform
from studio.engine.model.cameras.lens import Lens
from studio.simulator.clock import SimulatedClock, random_clock
from studio.simulator.instants import instants
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND
from studio.simulator.landmarks.fingers import SimulatedHands
from studio.simulator.landmarks.hand_tracker import HandTracker
from studio.simulator.landmarks.heads import FaceErrors, SimulatedHead
from studio.simulator.landmarks.timing import PictureTiming
from studio.simulator.landmarks.tracker import LandmarkTracker, SeenPicture, landmark_anatomy, random_lens
from studio.simulator.rig import RigCamera

ALL_AT_ONCE = PictureTiming()


@dataclass(frozen=True)
class SeenLandmarks:
    """All frames of one camera.

    Attributes:
        camera: its name.
        lens: its true lens.
        taken_s: true capture time of each frame [s], shape (F,).
        device_time_ns: capture times on the camera's clock, shape (F,).
        pictures: each frame's landmarks; None = nobody.
    """

    camera: str
    lens: Lens
    taken_s: NDArray[np.float64]
    device_time_ns: NDArray[np.int64]
    pictures: list[SeenPicture | None]


def see_landmarks(
    motion: CanonicalMotion,
    rig: tuple[RigCamera, ...],
    *,
    seed: int,
    timing: PictureTiming = ALL_AT_ONCE,
) -> Iterator[SeenLandmarks]:
    """Yield each camera's frames with the noise of `tracker`; the same seed gives the same frames.

    Args:
        motion: on the stage.
        rig: the cameras; the first one's clock is the stage clock.
        seed: of all noise, lenses and clocks.
        timing: picture timing of all cameras.
    """
    hands, head = SimulatedHands(motion.offsets_m, seed), SimulatedHead(seed)
    performer, *streams = np.random.SeedSequence(seed).spawn(1 + len(rig))
    anatomy = landmark_anatomy(np.random.default_rng(performer))
    for k, (camera, stream) in enumerate(zip(rig, streams, strict=True)):
        rng = np.random.default_rng(stream)
        clock, lens = random_clock(rng), random_lens(rng)
        clock = SimulatedClock() if k == 0 else clock
        taken = instants(rng, motion.duration_s, FRAMES_PER_SECOND)
        fingers = HandTracker(camera.T_stage_camera, lens, hands, seed=seed, camera=k)
        face = FaceErrors(seed=seed, camera=k)
        tracker = LandmarkTracker(
            camera.T_stage_camera, lens, motion.offsets_m, anatomy, rng, fingers, head, face
        )
        to_camera = invert_transform(camera.T_stage_camera)
        pictures = [tracker.see(timing.joints(motion, float(t), to_camera, lens), float(t)) for t in taken]
        kept = timing.taken(taken)
        taken, pictures = taken[kept], [picture for picture, keep in zip(pictures, kept, strict=True) if keep]
        stamps = np.round(clock.device_s(taken) * 1e9).astype(np.int64)
        yield SeenLandmarks(camera.name, lens, taken, stamps, pictures)

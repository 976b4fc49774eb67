"""A simulated ordinary camera in real time: landmarks of the embedded performer, with a pose network's errors."""

from dataclasses import dataclass

import numpy as np

from studio.camera.simulated.rig_config import RigCameraConfig
from studio.camera.simulated.skeletons import PerformedSource
from studio.camera.sources.source import SourceFrame
from studio.engine.model.joints import JOINT_SETS
from studio.simulator.landmarks.fingers import SimulatedHands
from studio.simulator.landmarks.hand_tracker import HandTracker
from studio.simulator.landmarks.heads import FaceErrors, SimulatedHead
from studio.simulator.landmarks.tracker import LandmarkTracker, landmark_anatomy, random_lens
from studio.wire import LandmarkArrays

_JOINTS = len(JOINT_SETS["mediapipe"])


@dataclass(frozen=True)
class SimulatedRgbConfig(RigCameraConfig):
    """A simulated camera of landmarks in pictures, `simulated-rgb:<index>/<count>[:<seed>]`."""

    kind = "simulated-rgb"

    def open(self) -> "SimulatedRgbSource":
        return SimulatedRgbSource(self.index, self.count, seed=self.seed)


class SimulatedRgbSource(PerformedSource):
    """A camera that sends landmarks; it does not send its lens."""

    device = "simulated ordinary camera"
    joint_set = "mediapipe"

    def __init__(self, index: int, count: int, *, seed: int = 0) -> None:
        super().__init__(index, count, seed=seed)
        self._lens = random_lens(self.rng)
        at, hands = self.rig_camera.T_stage_camera, SimulatedHands(self.motion.offsets_m, seed)
        self._tracker = LandmarkTracker(
            at,
            self._lens,
            self.motion.offsets_m,
            landmark_anatomy(self.performer_rng),
            self.rng,
            HandTracker(at, self._lens, hands, seed=seed, camera=index),
            SimulatedHead(seed),
            FaceErrors(seed=seed, camera=index),
        )

    def frame_at(self, time_ns: int) -> SourceFrame | None:
        time_s = self.performer_s(time_ns)
        seen = self._tracker.see(self.motion.at(time_s), time_s)
        if seen is None:
            return None
        return SourceFrame(
            self.clock.device_ns(time_ns),
            np.full((_JOINTS, 3), np.nan),
            seen.visibility,
            picture=LandmarkArrays(
                self._lens.width, self._lens.height, seen.pixels, seen.world_m, seen.hand(0), seen.hand(1)
            ),
        )

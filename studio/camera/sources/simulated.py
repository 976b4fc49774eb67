"""The embedded performer in real time, seen by one simulated camera.

The performer follows the wall clock, so that clients started apart see the same performer; each has its own
device clock.
"""

from abc import abstractmethod
from collections.abc import AsyncIterator
from dataclasses import dataclass

import numpy as np

from studio.camera.sources.pacing import WallClock
from studio.camera.sources.rig_config import RigCameraConfig
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.animation.motion.authored import stage_motion
from studio.engine.model.joints import INDEX
from studio.simulator.clock import jitter_s, random_clock
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import standard_rig
from studio.wire import HandState

_PERIOD_NS = round(1e9 / FRAMES_PER_SECOND)
_LATE_NS = 1_000_000_000
_METHODS = ("shape", "circles")
_SURE = 0.95


@dataclass(frozen=True)
class SimulatedConfig(RigCameraConfig):
    """A simulated camera of skeletons, `simulated:<index>/<count>[:<seed>]`."""

    kind = "simulated"

    def open(self) -> "SimulatedSource":
        return SimulatedSource(self.index, self.count, seed=self.seed)


class PerformedSource(Source):
    """Camera `index` of the standard rig of `count` cameras before the embedded performer.

    One `seed` for all cameras of a stage. The performer follows the wall clock.
    """

    frames_per_second = FRAMES_PER_SECOND

    def __init__(self, index: int, count: int, *, seed: int = 0) -> None:
        self.rig_camera = standard_rig(count)[index]
        performer, *streams = np.random.SeedSequence(seed).spawn(1 + count)
        self.name = self.rig_camera.name
        self.performer_rng = np.random.default_rng(performer)
        self.rng = np.random.default_rng(streams[index])
        self._wall = WallClock()
        self.clock = random_clock(self.rng, since_s=self._wall.start_ns * 1e-9)
        self.motion = stage_motion()

    def clock_ns(self) -> int:
        return self.clock.device_ns(self._wall.now_ns())

    async def frames(self) -> AsyncIterator[SourceFrame]:
        trigger_ns = self._wall.now_ns()
        while True:
            if self._wall.now_ns() - trigger_ns > _LATE_NS:  # the machine slept
                trigger_ns = self._wall.now_ns()
            taken_ns = trigger_ns + round(jitter_s(self.rng) * 1e9)
            await self._wall.wait_until(taken_ns)
            frame = self.frame_at(taken_ns)
            if frame is not None:
                yield frame
            trigger_ns += _PERIOD_NS

    @abstractmethod
    def frame_at(self, time_ns: int) -> SourceFrame | None:
        """Return the frame at a time of the wall clock [ns], None where nobody is seen; times must increase."""

    def performer_s(self, time_ns: int) -> float:
        """Return the time in the performance, which loops, at a time of the wall clock [s]."""
        return (time_ns % round(self.motion.duration_s * 1e9)) * 1e-9


class SimulatedSource(PerformedSource):
    """A camera that sends skeletons, with a tracker's errors."""

    device = "simulated camera"

    def __init__(self, index: int, count: int, *, seed: int = 0) -> None:
        super().__init__(index, count, seed=seed)
        anatomy = anatomical_offsets(self.performer_rng)
        self._tracker = NoisyJoints(self.rig_camera.T_stage_camera, self.motion.offsets_m, anatomy, self.rng)

    def frame_at(self, time_ns: int) -> SourceFrame:
        performer_s = self.performer_s(time_ns)
        positions, confidence = self._tracker.see(self.motion.at(performer_s))
        openness = self.motion.hands_open_at(performer_s)
        hands = tuple(
            HandState(side, method, min(max(share, 1 - _SURE), _SURE))
            for side, share in zip(("left", "right"), openness, strict=True)
            if np.isfinite(positions[INDEX[f"{side}_wrist"], 0])
            for method in _METHODS
        )
        return SourceFrame(self.clock.device_ns(time_ns), positions, confidence, hands)

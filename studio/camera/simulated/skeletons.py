"""The embedded performer in real time, or several, seen by one simulated camera.

The performer follows the wall clock, so that clients started apart see the same performer; each has its own
device clock.
"""

import re
from abc import abstractmethod
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from studio.camera.simulated.rig_config import RigCameraConfig
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.animation.motion.authored import stage_motion
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import INDEX
from studio.simulator.clock import jitter_s, random_clock
from studio.simulator.crowd.seen import LOST_SHARE, DeviceNumbers, hidden_of, overlaps_of
from studio.simulator.crowd.stage import MOST_PERFORMERS, crowd_stage
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import standard_rig
from studio.wire import HandState

_PERIOD_NS = round(1e9 / FRAMES_PER_SECOND)
_LATE_NS = 1_000_000_000
_METHODS = ("shape", "circles")
_SURE = 0.95


@dataclass(frozen=True)
class SimulatedConfig(RigCameraConfig):
    """A simulated camera of skeletons, `simulated:<index>/<count>[:<seed>[:<performers>[:<begin>]]]`.

    Attributes:
        performers: how many are on the stage, 1 to 4.
        begin_s: when the loop of several begins, by the wall clock [s].
    """

    kind = "simulated"
    performers: int = 1
    begin_s: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.performers <= MOST_PERFORMERS:
            raise SettingsError(
                "source.performers",
                "{count} simulated performers are not possible; allowed: 1 to {most}",
                count=self.performers,
                most=MOST_PERFORMERS,
            )

    @classmethod
    def parse(cls, text: str) -> Self:
        parts = text.split(":", 2)
        one = super().parse(":".join(parts[:2]))
        if len(parts) < 3:
            return one
        match = re.fullmatch(r"(\d{1,3})(?::(\d{1,12}))?", parts[2])
        if match is None:
            raise cls._refused(text)
        return replace(one, performers=int(match[1]), begin_s=int(match[2] or 0))

    def open(self) -> Source:
        if self.performers == 1:
            return SimulatedSource(self.index, self.count, seed=self.seed)
        return SimulatedCrowdSource(
            self.index, self.count, seed=self.seed, performers=self.performers, begin_s=self.begin_s
        )


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


class SimulatedCrowdSource(PerformedSource):
    """A camera that sends the skeletons of all performers, with a tracker's errors and a device's numbers.

    Args:
        index, count, seed: see `PerformedSource`.
        performers: how many, 2 to 4.
        begin_s: when their loop begins, by the wall clock [s].
    """

    device = "simulated camera"

    def __init__(self, index: int, count: int, *, seed: int, performers: int, begin_s: int) -> None:
        super().__init__(index, count, seed=seed)
        self._meeting = crowd_stage(performers)
        self.motion = self._meeting.motions[0]
        self._begin_ns = begin_s * 1_000_000_000
        self._eye = self.rig_camera.T_stage_camera[:3, 3]
        self._trackers = [
            NoisyJoints(
                self.rig_camera.T_stage_camera,
                one.offsets_m,
                anatomical_offsets(self.performer_rng),
                self.rng,
            )
            for one in self._meeting.motions
        ]
        self._numbers = DeviceNumbers(performers, self.rng)

    def frame_at(self, time_ns: int) -> SourceFrame | None:
        time_s = self.performer_s(time_ns - self._begin_ns)
        joints = np.array([motion.at(time_s) for motion in self._meeting.motions])[:, None]
        there = np.array([time_s >= enters_s for enters_s in self._meeting.enters_s])
        hidden = hidden_of(joints, there[:, None], self._eye)
        seen = [
            tracker.see_all(mine, behind)
            for tracker, mine, behind in zip(self._trackers, joints, hidden, strict=True)
        ]
        found = there & (hidden[:, 0].mean(axis=1) <= LOST_SHARE)
        numbers = self._numbers.of(found, overlaps_of(joints, self._eye)[..., 0])
        bodies = [
            SourceFrame(self.clock.device_ns(time_ns), positions[0], confidence[0], body=int(number))
            for (positions, confidence), number in zip(seen, numbers, strict=True)
            if number >= 0
        ]
        return replace(bodies[0], others=tuple(bodies[1:])) if bodies else None

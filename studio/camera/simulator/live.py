"""The embedded performer in real time, seen by one simulated camera.

The performer's time is the wall clock's, so that clients started apart watch the same performer; each has a
device clock of its own.
"""

import re
from collections.abc import AsyncIterator

import numpy as np

from studio.camera.pacing import WallClock
from studio.camera.simulator.clock import jitter_s, random_clock
from studio.camera.simulator.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.camera.simulator.rig import MAX_CAMERAS, standard_rig
from studio.camera.sources import SourceFrame
from studio.engine.errors import SettingsError
from studio.engine.joints import INDEX
from studio.engine.motion.authored import stage_motion
from studio.wire import HandState

_PERIOD_NS = round(1e9 / FRAMES_PER_SECOND)
_LATE_NS = 1_000_000_000
_METHODS = ("shape", "circles")
_SURE = 0.95


def open_simulated(argument: str) -> "SimulatedSource":
    """Return the source of `simulated:<index>/<count>[:<seed>]`.

    Raises:
        SettingsError: an argument that is not of this form, or a camera that the rig does not have.
    """
    match = re.fullmatch(r"(\d{1,3})/(\d{1,3})(?::(\d{1,18}))?", argument)
    if match is None or not int(match[1]) < int(match[2]) <= MAX_CAMERAS:
        raise SettingsError(
            f"source 'simulated:{argument}' is not allowed; allowed: simulated:<index>/<count>[:<seed>] with "
            f"a count from 1 to {MAX_CAMERAS} and an index from 0 to count - 1, such as simulated:0/2"
        )
    return SimulatedSource(int(match[1]), int(match[2]), seed=int(match[3] or 0))


class SimulatedSource:
    """Camera `index` of the standard rig of `count` cameras; one `seed` for all cameras of a stage."""

    device = "simulated camera"
    joint_set = "canonical"
    frames_per_second = FRAMES_PER_SECOND
    realtime = True

    def __init__(self, index: int, count: int, *, seed: int = 0) -> None:
        camera = standard_rig(count)[index]
        performer, *streams = np.random.SeedSequence(seed).spawn(1 + count)
        self.name = camera.name
        self._rng = np.random.default_rng(streams[index])
        self._wall = WallClock()
        self._clock = random_clock(self._rng, since_s=self._wall.start_ns * 1e-9)
        self._motion = stage_motion()
        self._tracker = NoisyJoints(
            camera.T_stage_camera,
            self._motion.offsets_m,
            anatomical_offsets(np.random.default_rng(performer)),
            self._rng,
        )

    def clock_ns(self) -> int:
        return self._clock.device_ns(self._wall.now_ns())

    async def frames(self) -> AsyncIterator[SourceFrame]:
        trigger_ns = self._wall.now_ns()
        while True:
            if self._wall.now_ns() - trigger_ns > _LATE_NS:  # the machine slept
                trigger_ns = self._wall.now_ns()
            taken_ns = trigger_ns + round(jitter_s(self._rng) * 1e9)
            await self._wall.wait_until(taken_ns)
            yield self.frame_at(taken_ns)
            trigger_ns += _PERIOD_NS

    def frame_at(self, time_ns: int) -> SourceFrame:
        """Return the frame taken at a time of the wall clock [ns]; one after the other."""
        performer_s = self.performer_s(time_ns)
        positions, confidence = self._tracker.see(self._motion.at(performer_s))
        openness = self._motion.hands_open_at(performer_s)
        hands = tuple(
            HandState(side, method, min(max(share, 1 - _SURE), _SURE))
            for side, share in zip(("left", "right"), openness, strict=True)
            if np.isfinite(positions[INDEX[f"{side}_wrist"], 0])
            for method in _METHODS
        )
        return SourceFrame(self._clock.device_ns(time_ns), positions, confidence, hands)

    def performer_s(self, time_ns: int) -> float:
        """Return where in the performance, which repeats, a time of the wall clock lies [s]."""
        return (time_ns % round(self._motion.duration_s * 1e9)) * 1e-9

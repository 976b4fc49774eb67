"""A simulated depth camera in real time: the embedded performer, seen by one camera of a standard rig.

The performer follows the wall clock, so that clients started apart see the same performer; each has its own device
clock.
"""

import asyncio
from collections.abc import AsyncIterator

import numpy as np

from studio.camera.sources.depth_source import DepthShot, DepthSource
from studio.camera.sources.pacing import WallClock
from studio.engine.animation.motion.authored import stage_motion
from studio.simulator.body.performers import DEFAULT
from studio.simulator.clock import jitter_s, random_clock
from studio.simulator.performer.motion import perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage, dropped

_SENSOR = "azure-kinect"


class SimulatedDepthSource(DepthSource):
    """Camera `index` of the standard rig of `count` cameras; one `seed` for all cameras of a stage.

    A machine that is too slow gets fewer than `frames_per_second`.
    """

    def __init__(self, index: int, count: int, *, seed: int = 0) -> None:
        sensor, rig = find_sensor(_SENSOR), standard_rig(count)
        self.name = rig[index].name
        self.device = f"simulated {sensor.device}"
        self.camera = sensor.camera
        self.frames_per_second = sensor.frames_per_second
        performance = perform(stage_motion(), DEFAULT)
        self._duration_ns = round(performance.motion.duration_s * 1e9)
        self._simulated = DepthStage.of(sensor, rig, performance, DEFAULT, seed=seed).camera(index)
        self._simulated.image(0.0)  # compiles the code
        self._rng = np.random.default_rng([seed, index])
        self._wall = WallClock()
        self._clock = random_clock(self._rng, since_s=self._wall.start_ns * 1e-9)

    def clock_ns(self) -> int:
        return self._clock.device_ns(self._wall.now_ns())

    async def frames(self) -> AsyncIterator[DepthShot]:
        period_ns = round(1e9 / self.frames_per_second)
        trigger_ns = self._wall.now_ns()
        while True:
            taken_ns = trigger_ns + round(jitter_s(self._rng) * 1e9)
            await self._wall.wait_until(taken_ns)
            if not dropped(self._rng, 1)[0]:
                yield (
                    self._clock.device_ns(taken_ns),
                    await asyncio.to_thread(self._simulated.image, self.performer_s(taken_ns)),
                )
            late = max(self._wall.now_ns() - trigger_ns, 0) // period_ns
            trigger_ns += max(late, 1) * period_ns

    def performer_s(self, time_ns: int) -> float:
        """Return the time in the performance, which loops, at a time of the wall clock [s]."""
        return (time_ns % self._duration_ns) * 1e-9

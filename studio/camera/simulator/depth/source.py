"""A simulated depth camera in real time: the embedded performer, seen by one camera of a standard rig.

The performer's time is the wall clock's, so that clients started apart watch the same performer; each has a device
clock of its own.
"""

import asyncio
import re
from collections.abc import AsyncIterator

import numpy as np
from numpy.typing import NDArray

from studio.camera.pacing import WallClock
from studio.camera.simulator.clock import jitter_s, random_clock
from studio.camera.simulator.depth.motion import perform
from studio.camera.simulator.depth.performers import DEFAULT
from studio.camera.simulator.depth.sensors import find_sensor
from studio.camera.simulator.depth.stage import DepthStage, dropped
from studio.camera.simulator.rig import MAX_CAMERAS, standard_rig
from studio.engine.errors import SettingsError
from studio.engine.motion.authored import stage_motion

_SENSOR = "azure-kinect"


def open_simulated_depth(argument: str) -> "SimulatedDepthSource":
    """Return the source of `simulated-depth:<index>/<count>[:<seed>]`.

    Raises:
        SettingsError: an argument that is not of this form, or a camera that the rig does not have.
    """
    match = re.fullmatch(r"(\d{1,3})/(\d{1,3})(?::(\d{1,18}))?", argument)
    if match is None or not int(match[1]) < int(match[2]) <= MAX_CAMERAS:
        raise SettingsError(
            f"source 'simulated-depth:{argument}' is not allowed; allowed: simulated-depth:<index>/<count>[:<seed>] "
            f"with a count from 1 to {MAX_CAMERAS} and an index from 0 to count - 1, such as simulated-depth:0/2"
        )
    return SimulatedDepthSource(int(match[1]), int(match[2]), seed=int(match[3] or 0))


class SimulatedDepthSource:
    """Camera `index` of the standard rig of `count` cameras; one `seed` for all cameras of a stage.

    Attributes:
        name: the camera's name where the user gives none.
        device: what it is, for people.
        camera: intrinsics of the images.
        frames_per_second: nominal; a machine that is too slow gets fewer.
        realtime: frames come at their own pace, and an old one may be dropped.
    """

    realtime = True

    def __init__(self, index: int, count: int, *, seed: int = 0) -> None:
        sensor, rig = find_sensor(_SENSOR), standard_rig(count)
        self.name = rig[index].name
        self.device = f"simulated {sensor.device}"
        self.camera = sensor.camera
        self.frames_per_second = sensor.frames_per_second
        performance = perform(stage_motion(), DEFAULT)
        self._duration_ns = round(performance.motion.duration_s * 1e9)
        self._simulated = DepthStage.of(sensor, rig, performance, DEFAULT, seed=seed).camera(index)
        self._simulated.image(0.0)  # compiles what is not compiled yet
        self._rng = np.random.default_rng([seed, index])
        self._wall = WallClock()
        self._clock = random_clock(self._rng, since_s=self._wall.start_ns * 1e-9)

    def clock_ns(self) -> int:
        """Return the clock that stamps the images, now [ns]."""
        return self._clock.device_ns(self._wall.now_ns())

    async def frames(self) -> AsyncIterator[tuple[int, NDArray[np.uint16]]]:
        """Yield device time [ns] and depth [mm], shape (height, width), as the images come."""
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
        """Return where in the performance, which repeats, a time of the wall clock lies [s]."""
        return (time_ns % self._duration_ns) * 1e-9

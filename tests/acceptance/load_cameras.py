"""Many camera clients in one process: python -m tests.acceptance.load_cameras URL FOLDER COUNT, until it is ended.

Each sends a performer in 25 joints at 30 Hz and keeps the frames of recordings in a spool of its own.
"""

import asyncio
import signal
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np

from studio import wire
from studio.camera.client.link import Link
from studio.camera.client.spool import Spool
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.model.joints import JOINT_SETS, to_canonical
from tests.live.performer import frame

JOINT_SET = "kinect-v2"
COUNT = len(JOINT_SETS[JOINT_SET])
PERIOD_NS = 33_333_333


def _device_of_canonical() -> np.ndarray:
    """Index of a device joint for each canonical one; -1 where the device has none."""
    numbers = np.repeat(np.arange(COUNT, dtype=float)[:, None], 3, axis=1)
    found = to_canonical(JOINT_SET, numbers, np.ones(COUNT))[0][:, 0]
    return np.where(np.isnan(found), -1, np.nan_to_num(found)).astype(int)


class Performer(Source):
    """The source of one camera of the simulated stage."""

    device, joint_set = "load", JOINT_SET

    def __init__(self, index: int) -> None:
        self.name = f"camera_{index}"
        self._index = index
        self._wall = WallClock()
        self._device = _device_of_canonical()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[SourceFrame]:
        taken_ns, sequence = self._wall.now_ns(), 0
        while True:
            await self._wall.wait_until(taken_ns)
            seen, _ = wire.joint_arrays(
                frame(self._index, sequence, taken_ns, taken_ns * 1e-9 % 60), "canonical"
            )
            joints = np.full((COUNT, 3), seen[0])
            joints[self._device[self._device >= 0]] = seen[self._device >= 0]
            yield SourceFrame(taken_ns, joints, np.full(COUNT, 0.9))
            taken_ns += PERIOD_NS
            sequence += 1


async def main(url: str, folder: Path, count: int) -> None:
    spools = [Spool(folder / f"load_{index}") for index in range(count)]
    links = [Link(Performer(index), url, spool=spools[index]) for index in range(count)]
    work = asyncio.gather(*(link.run() for link in links))
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, work.cancel)
    try:
        await work
    except asyncio.CancelledError:
        for spool in spools:
            spool.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])))

"""A camera of one's own, linked to a studio that runs: somebody who stands and waves.

    python examples/own_camera.py http://127.0.0.1:8000 [FRAMES]

It appears on the page like any camera; its frames are kept until the server has them on its disk. Put your device in
the place of `Waving.frames`. Without FRAMES it goes on until Ctrl-C.
"""

import asyncio
import math
import sys
import time
from collections.abc import AsyncIterator

import numpy as np

import studio

# Joints of somebody in a T-pose, 3 m before the camera: x right, y down, z forward, in metres.
BODY = {
    "hips": (0, 0, 3), "spine": (0, -0.15, 3), "chest": (0, -0.4, 3), "neck": (0, -0.5, 3), "head": (0, -0.7, 3),
    "left_shoulder": (0.2, -0.5, 3), "left_elbow": (0.5, -0.5, 3), "left_wrist": (0.75, -0.5, 3),
    "right_shoulder": (-0.2, -0.5, 3), "right_elbow": (-0.5, -0.5, 3), "right_wrist": (-0.75, -0.5, 3),
    "left_hip": (0.1, 0, 3), "left_knee": (0.1, 0.45, 3), "left_ankle": (0.1, 0.85, 3), "left_toe": (0.1, 0.9, 2.88),
    "right_hip": (-0.1, 0, 3), "right_knee": (-0.1, 0.45, 3), "right_ankle": (-0.1, 0.85, 3),
    "right_toe": (-0.1, 0.9, 2.88),
}  # fmt: skip


class Waving(studio.Source):
    """Gives canonical joints, 30 frames a second; joints that it does not know are unseen (NaN)."""

    name = "waving"
    device = "an example"

    def __init__(self, count: int | None) -> None:
        self._count = count

    def clock_ns(self) -> int:
        """Return the clock that stamps the frames, now [ns]."""
        return time.monotonic_ns()

    async def frames(self) -> AsyncIterator[studio.SourceFrame]:
        """Yield frames as they come."""
        number = 0
        while self._count is None or number < self._count:
            positions = np.full((len(studio.CANONICAL), 3), np.nan)
            for joint, place in BODY.items():
                positions[studio.CANONICAL.index(joint)] = place
            angle = 0.8 * math.sin(2 * math.pi * number / 30)
            elbow = positions[studio.CANONICAL.index("left_elbow")]
            forearm = np.array([0.25 * math.sin(angle), -0.25 * math.cos(angle), 0.0])
            positions[studio.CANONICAL.index("left_wrist")] = elbow + forearm
            confidence = np.isfinite(positions[:, 0]).astype(float)
            yield studio.SourceFrame(self.clock_ns(), positions, confidence)
            number += 1
            await asyncio.sleep(1 / self.frames_per_second)


def main(server: str, count: int | None) -> None:
    studio.run_camera(Waving(count), server)
    print("the camera has ended")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else None)

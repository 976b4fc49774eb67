"""Playback of a recorded depth camera: a take, or any recording that `studio import` reads."""

import asyncio
from collections.abc import AsyncIterator, Iterator

from studio.camera.sources.depth_source import DepthShot, DepthSource
from studio.camera.sources.pacing import WallClock
from studio.engine.base.errors import FormatError
from studio.take.importers.recording import ReadDepth
from studio.take.raw.records import depth_camera

_PAUSE_NS = 500_000_000
"""Pause between two rounds."""


class DepthRecordingSource(DepthSource):
    """Plays one camera's depth images.

    In real time it loops in step with the wall clock, so that clients of the same recording play the
    same moment. Images get new stamps from the wall clock, with the offsets between the recorded clocks.
    Images that cannot be read in time are skipped. Otherwise it plays once, as fast as it is read, with the
    recorded stamps.

    Args:
        name: of the camera.
        recording: the depth images of every camera of the recording, by name.
        realtime: see above.

    Raises:
        FormatError: no image of the camera can be read.
    """

    def __init__(self, name: str, recording: dict[str, ReadDepth], *, realtime: bool) -> None:
        depth = recording[name]
        self.name = name
        self.device = depth.device
        self.camera = depth_camera(depth.intrinsics)
        self.frames_per_second = depth.frames_per_second
        self.realtime = realtime
        self._depth = depth
        self._wall = WallClock()
        firsts = {other: next(of.stream(), None) for other, of in recording.items()}
        begins = {other: first[0] for other, first in firsts.items() if first is not None}
        if name not in begins:
            raise FormatError("depth.none_readable", "no depth image of {name} can be read", name=name)
        self._newest_ns = begins[name]
        self._first_ns = min(begins.values())
        lengths = [
            begin_ns
            - self._first_ns
            + recording[other].frame_count * 1e9 / recording[other].frames_per_second
            for other, begin_ns in begins.items()
        ]
        self._period_ns = round(max(lengths)) + _PAUSE_NS

    def clock_ns(self) -> int:
        return self._wall.now_ns() if self.realtime else self._newest_ns

    async def frames(self) -> AsyncIterator[DepthShot]:
        if not self.realtime:
            stream = self._depth.stream()
            while (shot := await asyncio.to_thread(_next, stream)) is not None:
                self._newest_ns = shot[0]
                yield shot
            return
        now_ns = self._wall.now_ns()
        round_ns = now_ns - now_ns % self._period_ns
        while True:
            stream = self._depth.stream()
            while (shot := await asyncio.to_thread(_next, stream)) is not None:
                stamp_ns = round_ns + shot[0] - self._first_ns
                if self._wall.now_ns() - stamp_ns > 2e9 / self.frames_per_second:
                    continue
                await self._wall.wait_until(stamp_ns)
                yield stamp_ns, shot[1]
            round_ns += self._period_ns
            await self._wall.wait_until(round_ns)


def _next(stream: Iterator[DepthShot]) -> DepthShot | None:
    return next(stream, None)

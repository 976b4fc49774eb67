"""The short queue between a source and the network: the newest frames, the oldest goes first."""

import asyncio
from collections import deque


class FrameQueue:
    """Encoded frames on their way, with their sequences; at most `capacity`.

    Attributes:
        dropped: frames that there was no room for.
        ended: the source gives no more.
    """

    def __init__(self, capacity: int) -> None:
        self._frames: deque[tuple[int, bytes]] = deque()
        self._capacity = capacity
        self._changed = asyncio.Event()
        self._room = asyncio.Event()
        self.dropped = 0
        self.ended = False

    def __len__(self) -> int:
        return len(self._frames)

    async def put(self, sequence: int, frame: bytes, *, wait: bool) -> int | None:
        """Add a frame: wait for room, or drop the oldest where there is none and return its sequence."""
        gone = None
        while wait and len(self._frames) >= self._capacity:
            self._room.clear()
            await self._room.wait()
        if len(self._frames) >= self._capacity:
            gone = self._frames.popleft()[0]
            self.dropped += 1
        self._frames.append((sequence, frame))
        self._changed.set()
        return gone

    def pop(self) -> tuple[int, bytes] | None:
        """Return the oldest frame with its sequence, None where there is none."""
        if not self._frames:
            self._changed.clear()
            return None
        self._room.set()
        return self._frames.popleft()

    async def wait(self) -> None:
        """Return once something has changed since `pop` found nothing."""
        await self._changed.wait()

    def wake(self) -> None:
        """Let those who wait look again."""
        self._changed.set()

    def end(self) -> None:
        """Say that no frame comes any more."""
        self.ended = True
        self._changed.set()

"""The short queue between a source and the network. It holds the newest frames; the oldest is dropped first."""

import asyncio
from collections import deque


class FrameQueue:
    """At most `capacity` encoded frames, with their sequences.

    Attributes:
        dropped: number of dropped frames.
        ended: the source has no more frames.
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
        """Add a frame. If the queue is full, wait, or drop the oldest and return its sequence."""
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
        """Return the oldest frame with its sequence, None if there is none."""
        if not self._frames:
            self._changed.clear()
            return None
        self._room.set()
        return self._frames.popleft()

    async def wait(self) -> None:
        """Wait for a change after `pop` found nothing."""
        await self._changed.wait()

    def wake(self) -> None:
        """Wake the waiting tasks."""
        self._changed.set()

    def end(self) -> None:
        """Mark the end of the frames."""
        self.ended = True
        self._changed.set()

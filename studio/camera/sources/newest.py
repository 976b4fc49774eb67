"""The newest of what a camera gives, for a reader that is slower than the camera."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import TypeVar

_Item = TypeVar("_Item")


async def newest_of(items: AsyncIterator[_Item], passed_over: Callable[[int], None]) -> AsyncIterator[_Item]:
    """Yield the newest item on demand; those in between are skipped.

    Args:
        items: read as they come.
        passed_over: called with the number of items that were skipped, after each that came.
    """
    slot: list[_Item] = []
    came = asyncio.Event()

    async def read() -> None:
        try:
            async for item in items:
                passed_over(len(slot))
                slot[:] = [item]
                came.set()
        finally:
            came.set()

    reader = asyncio.create_task(read())
    try:
        while True:
            await came.wait()
            came.clear()
            if slot:
                yield slot.pop()
            elif reader.done():
                reader.result()
                return
    finally:
        reader.cancel()
        await asyncio.gather(reader, return_exceptions=True)

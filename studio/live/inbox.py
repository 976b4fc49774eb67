"""The queue from the event loop to the engine thread; the reader takes all items at once."""

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from studio.engine.model.frames import CameraFrame
from studio.wire import ClockSample, Hello, Status


@dataclass(frozen=True)
class Left:
    """A camera's client has left; `error`: because of what it sent."""

    camera: str
    reason: str
    error: bool


@dataclass(frozen=True)
class Arrived:
    """A frame with its bytes and its arrival on the server's clock [ns].

    `hello` is of the start of the client that took it; `kept_for`: id of the take for which the client kept it and
    sends it again.
    """

    frame: CameraFrame
    data: bytes
    arrival_ns: int
    hello: Hello
    kept_for: str = ""


@dataclass(frozen=True)
class ClockExchange:
    """A finished clock exchange of a camera."""

    camera: str
    sample: ClockSample


@dataclass(frozen=True)
class Reported:
    """A client's own status."""

    camera: str
    status: Status


@dataclass(frozen=True)
class Call:
    """A function to run on the engine thread; its result or error goes to `future`."""

    function: Callable[[], Any]
    future: "Future[Any]"


Item = Left | Arrived | ClockExchange | Reported | Call


class Inbox:
    """A queue with many writers, which never wait, and one reader."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._items: deque[Item] = deque()

    def __len__(self) -> int:
        return len(self._items)

    def put(self, item: Item) -> None:
        with self._changed:
            self._items.append(item)
            self._changed.notify()

    def put_back(self, items: list[Item]) -> None:
        """Put items back in front, in their order."""
        with self._changed:
            self._items.extendleft(reversed(items))

    def take(self, timeout_s: float) -> list[Item]:
        """Return all items, in order; waits up to `timeout_s` for the first."""
        with self._changed:
            if not self._items:
                self._changed.wait(timeout_s)
            items = list(self._items)
            self._items.clear()
            return items

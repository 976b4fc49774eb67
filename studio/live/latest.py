"""A value for many reading and waiting threads, of which only the newest counts."""

import threading
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Latest(Generic[Value]):
    """Holds the newest value of a stream; a slow reader misses values and never delays the writer."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._number = 0
        self._value: Value | None = None

    def publish(self, value: Value) -> None:
        """Replace the value and wake waiting readers."""
        with self._changed:
            self._number += 1
            self._value = value
            self._changed.notify_all()

    def get(self) -> tuple[int, Value | None]:
        """Return the number of values published so far and the newest (0 and None before the first)."""
        with self._changed:
            return self._number, self._value

    def wait(self, after: int, timeout_s: float) -> tuple[int, Value | None]:
        """Return as `get` does, once the number is above `after`, or after `timeout_s`."""
        with self._changed:
            self._changed.wait_for(lambda: self._number > after, timeout_s)
            return self._number, self._value

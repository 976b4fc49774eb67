"""Functions compiled for speed by numba, kept on disk between runs where there is a place to keep them."""

import functools
import threading
from collections.abc import Callable
from typing import Any

_lock = threading.Lock()


class Compiled:
    """A function that is compiled on its first call; numba, which takes long to load, is loaded then.

    While it runs, other threads may. The result is kept beside the source, or in the user's cache folder where the
    source's folder cannot be written; where neither can, it is compiled anew in every process. A compiled function
    may only call others of its own module: a kept result does not notice that another module has changed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self._function = function
        self._dispatcher: Callable[..., Any] | None = None

    def __call__(self, *args: Any) -> Any:
        """Return what the function returns."""
        return (self._dispatcher or self.dispatcher())(*args)

    def dispatcher(self) -> Callable[..., Any]:
        """Return numba's own object, which from now on stands in the module, where compiled functions look."""
        with _lock:
            if self._dispatcher is None:
                names = self._function.__globals__
                for name, value in list(names.items()):
                    if isinstance(value, Compiled) and value.__module__ == self.__module__:
                        names[name] = value._dispatched()
            return self._dispatched()

    def _dispatched(self) -> Callable[..., Any]:
        if self._dispatcher is None:
            import numba

            try:
                self._dispatcher = numba.njit(cache=True, nogil=True)(self._function)
            except RuntimeError:  # numba found no folder that it can write
                self._dispatcher = numba.njit(nogil=True)(self._function)
        return self._dispatcher


def compiled(function: Callable[..., Any]) -> Compiled:
    """Return the function compiled on its first call."""
    return Compiled(function)

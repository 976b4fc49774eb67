"""Functions compiled by numba and cached on disk where a folder is writable."""

import contextlib
import functools
import logging
import threading
from collections.abc import Callable
from typing import Any

_lock = threading.Lock()
_log = logging.getLogger(__name__)


class Compiled:
    """A function that numba compiles on its first call. numba itself is imported then, because its import is slow.

    The function releases the GIL. The result is cached next to the source, or else in the user's cache folder. Where
    neither can be written, each process compiles again. A compiled function may call only functions of its own
    module, because the cache does not notice changes in other modules.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self._function = function
        self._dispatcher: Callable[..., Any] | None = None

    def __call__(self, *args: Any) -> Any:
        """Call the compiled function."""
        return (self._dispatcher or self.dispatcher())(*args)

    def dispatcher(self) -> Callable[..., Any]:
        """Return numba's dispatcher and put it into the module, where other compiled functions look it up."""
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
                self._dispatcher = _readable(numba.njit(cache=True, nogil=True)(self._function))
            except RuntimeError:  # numba found no writable folder
                self._dispatcher = numba.njit(nogil=True)(self._function)
        return self._dispatcher


def _readable(dispatcher: Any) -> Callable[..., Any]:
    """Empty the cache of a function if it cannot be read: an earlier version's classes may have had other names."""
    kept = dispatcher._cache._cache_file
    try:
        kept._load_index()
    except Exception as error:  # whatever unpickling raises
        _log.info("the cache of %s is made anew: %s", dispatcher, error)
        with contextlib.suppress(OSError):
            kept.flush()
    return dispatcher


def compiled(function: Callable[..., Any]) -> Compiled:
    """Return the function compiled on its first call."""
    return Compiled(function)

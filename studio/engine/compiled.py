"""Functions compiled for speed by numba, kept on disk between runs where there is a place to keep them."""

from collections.abc import Callable
from typing import Any

import numba


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function compiled on its first call; while it runs, other threads may.

    The result is kept beside the source, or in the user's cache folder where the source's folder cannot be
    written; where neither can, it is compiled anew in every process. A compiled function may only call others of
    its own module: a kept result does not notice that another module has changed.
    """
    try:
        return numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:  # numba found no folder that it can write
        return numba.njit(nogil=True)(function)

"""One network, run by LiteRT on the processor."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import NotAvailableError
from studio.engine.seeing.pictures.bundle import broken

_loading = threading.Lock()


class Network:
    """A network with one image as its input; used by one thread at a time.

    Args:
        content: a file of LiteRT (`.tflite`).
        path: where it came from, for errors.
        outputs: number of elements of each wanted output; the first output of that size is taken.
        threads: number on which it runs.

    Attributes:
        side: width and height of the image.

    Raises:
        FormatError: no network with one image as input and these outputs.
        NotAvailableError: LiteRT is not installed.
    """

    def __init__(self, content: bytes, path: Path, outputs: tuple[int, ...], threads: int = 1) -> None:
        interpreter = _interpreter()
        try:
            with _silence():
                self._interpreter = interpreter(model_content=content, num_threads=threads)
                self._interpreter.allocate_tensors()
        except (ValueError, RuntimeError) as error:
            raise broken(path, error) from error
        inputs = self._interpreter.get_input_details()
        shape = tuple(inputs[0]["shape"]) if len(inputs) == 1 else ()
        if len(shape) != 4 or shape[1] != shape[2] or shape[3] != 3 or inputs[0]["dtype"] != np.float32:
            raise broken(path, "its network has another input than one image")
        self.side = int(shape[1])
        self._input = inputs[0]["index"]
        by_size: dict[int, int] = {}
        for one in self._interpreter.get_output_details():
            by_size.setdefault(int(np.prod(one["shape"])), one["index"])
        if any(size not in by_size for size in outputs):
            raise broken(path, "its network has other outputs")
        self._outputs = [by_size[size] for size in outputs]

    def __call__(self, image: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Return the outputs in the order of `outputs`.

        Args:
            image: shape (side, side, 3).
        """
        self._interpreter.set_tensor(self._input, image[None])
        self._interpreter.invoke()
        return [self._interpreter.get_tensor(index) for index in self._outputs]


def _interpreter() -> Any:
    try:
        from ai_edge_litert.interpreter import Interpreter
    except (ImportError, OSError) as error:
        raise NotAvailableError(
            "pose.no_runtime",
            "poses from pictures need LiteRT, which does not load here ({error}); it runs on Linux, Windows and "
            "macOS with Apple's processors: install the studio again, or use a phone",
            error=error,
        ) from error
    return Interpreter


@contextmanager
def _silence() -> Iterator[None]:
    """Suppress LiteRT's messages about its own delegates on the terminal; its errors are raised."""
    with _loading, open(os.devnull, "w", encoding="utf-8") as nowhere:
        kept = os.dup(2)
        try:
            os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)

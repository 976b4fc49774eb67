"""The newest depth image of every camera: a whole one while a take with depth is recorded, else a preview."""

import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera

WHOLE_NS = 500_000_000
"""Time after a whole image in which previews do not replace it [ns]: they show the same with fewer pixels."""

MAX_CAMERAS = 64


@dataclass(frozen=True, eq=False)
class ArrivedDepth:
    """A depth image as it arrived.

    Attributes:
        camera: the image's intrinsics.
        depth_mm: z per pixel [mm], shape (height, width); 0 = no reading.
        arrival_ns: when it came, on the server's clock [ns].
        whole: with all its pixels; else a preview.
    """

    camera: DepthCamera
    depth_mm: NDArray[np.uint16]
    arrival_ns: int
    whole: bool


class NewestDepth:
    """The newest images by camera; methods may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._newest: dict[str, ArrivedDepth] = {}

    def put(self, name: str, image: ArrivedDepth) -> None:
        """Keep a camera's image as its newest; of more than `MAX_CAMERAS`, the first is dropped."""
        with self._lock:
            last = self._newest.get(name)
            if last is None and len(self._newest) >= MAX_CAMERAS:
                del self._newest[next(iter(self._newest))]
            if image.whole or last is None or not last.whole or image.arrival_ns - last.arrival_ns > WHOLE_NS:
                self._newest[name] = image

    def get(self, name: str) -> ArrivedDepth | None:
        """Return a camera's newest image; None before the first."""
        with self._lock:
            return self._newest.get(name)

    def names(self) -> tuple[str, ...]:
        """Return the cameras that sent depth, sorted."""
        with self._lock:
            return tuple(sorted(self._newest))

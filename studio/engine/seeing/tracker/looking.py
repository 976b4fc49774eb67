"""Parallel processing of several cameras' images on the machine's cores, and of the next images during a fit.

Compiled code runs without Python's lock, so threads suffice. The results do not depend on the order of the threads:
each camera's images are processed one after the other, and cameras share nothing.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache, partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.system import core_count
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.seeing.fitting.fit import MeasuredPoints
from studio.engine.seeing.images.silhouette import Silhouette
from studio.engine.seeing.tracker.view import CameraView, ImageClusters

T = TypeVar("T")

Later = Callable[[], T]
"""Function that waits for a result and returns it, or raises its error."""


class Looker:
    """Processes the images of one tracker's cameras; with one camera or one core, in the calling thread.

    Args:
        views: the cameras by name.
    """

    def __init__(self, views: Mapping[str, CameraView]) -> None:
        self._views = views
        count = min(len(views), core_count())
        self._pool = _pool(count) if count > 1 else None
        self._next: dict[str, DepthFrame] = {}
        self._begun: dict[str, Future[ImageClusters]] = {}

    def expect(self, frames: Mapping[str, DepthFrame] | None) -> None:
        """Set the images that come next; None = unknown."""
        self._next = dict(frames or {})

    def seen(self, frames: Mapping[str, DepthFrame]) -> dict[str, ImageClusters]:
        """Return the content of these images, by camera, in the order of `frames`.

        Raises:
            FormatError: the size of an image is not its camera's.
        """
        begun, self._begun = self._begun, {}
        if any(self._next.get(name) is not frame for name, frame in frames.items()):
            _wait(begun)
            begun = {}
        later = {
            name: begun[name].result
            if name in begun
            else self._each(partial(self._views[name].see, frame.depth_mm))
            for name, frame in frames.items()
        }
        return {name: result() for name, result in later.items()}

    def begin(self) -> None:
        """Start work on the expected images; the background must have been learnt from the present ones."""
        if self._pool is not None:
            for name, frame in self._next.items():
                self._begun[name] = self._pool.submit(self._views[name].see, frame.depth_mm)

    def drop(self) -> None:
        """Discard started work, because the background is still learnt from the present images."""
        begun, self._begun = self._begun, {}
        _wait(begun)

    def gathered(
        self,
        seen: Mapping[str, ImageClusters],
        chosen: Mapping[str, NDArray[np.bool_]],
        count: int,
        moved: Callable[[str, MeasuredPoints], MeasuredPoints],
    ) -> tuple[MeasuredPoints, dict[str, Silhouette]]:
        """Return the points of chosen clusters, about `count` of each camera, and their silhouettes by camera.

        Args:
            moved: brings a camera's points to the common instant.
        """
        used = [name for name in seen if chosen[name].any()]
        if not used:
            return MeasuredPoints.none(), {}
        later = [
            self._each(partial(self._views[name].silhouette_of, seen[name], chosen[name])) for name in used
        ]
        index_of = {name: index for index, name in enumerate(seen)}
        parts = [
            moved(name, self._views[name].points_of(seen[name], chosen[name], count, index_of[name]))
            for name in used
        ]
        points = MeasuredPoints(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
        return points, {name: silhouette() for name, silhouette in zip(used, later, strict=True)}

    def _each(self, work: Callable[[], T]) -> Later[T]:
        """Start one camera's work; return the function that waits for its result."""
        if self._pool is None:
            result = work()
            return lambda: result
        return self._pool.submit(work).result


def _wait(begun: Mapping[str, Future[ImageClusters]]) -> None:
    for future in begun.values():
        future.exception()


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    """Return the pool that all trackers with this number of threads share."""
    return ThreadPoolExecutor(count, thread_name_prefix="looking")

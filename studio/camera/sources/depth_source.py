"""A camera of depth images."""

from abc import abstractmethod
from collections.abc import AsyncIterator

import numpy as np
from numpy.typing import NDArray

from studio.camera.sources.source import Camera
from studio.engine.base.errors import StudioError
from studio.engine.model.cameras.depth import DepthCamera

DepthShot = tuple[int, NDArray[np.uint16]]
"""Capture time on the source's clock [ns], and depth [mm], shape (height, width); 0 = no reading."""


class DeviceLostError(StudioError):
    """A device gives no more images: unplugged, reset, or its library failed."""


class DepthSource(Camera):
    """A camera that gives depth images; `tracked.TrackedSource` makes skeletons of them.

    Attributes:
        camera: intrinsics of every image.
    """

    camera: DepthCamera

    @abstractmethod
    def frames(self) -> AsyncIterator[DepthShot]:
        """Yield images as they come; ends with the source.

        Raises:
            DeviceLostError: the device is lost; opening the source again may find it.
        """

"""A picture from an open camera, for choosing a camera."""

import asyncio

import numpy as np
from numpy.typing import NDArray

from studio.camera.sources.depth_source import DepthSource
from studio.camera.sources.source import Source
from studio.engine.base.errors import NotAvailableError, StudioError
from studio.engine.model.cameras.depth import shade

_IMAGES = 5
"""Number of images within which one must have readings: the first ones of many devices are empty."""

_WAIT_S = 10.0


def picture_of(camera: Source | DepthSource) -> NDArray[np.uint8]:
    """Return the first good depth image of a camera as grey levels, near = bright, shape (height, width).

    Raises:
        NotAvailableError: it gives skeletons, not images.
        StudioError: no image came.
    """
    if not isinstance(camera, DepthSource):
        raise NotAvailableError(
            "picture.skeletons", "{device} gives skeletons and no pictures", device=camera.device
        )
    return shade(asyncio.run(_first_image(camera)))


async def _first_image(camera: DepthSource) -> NDArray[np.uint16]:
    frames, newest = aiter(camera.frames()), None
    for _ in range(_IMAGES):
        try:
            _, newest = await asyncio.wait_for(anext(frames), _WAIT_S)
        except (StopAsyncIteration, TimeoutError):
            break
        if newest.any():
            return newest
    if newest is None:
        raise no_image(camera.device)
    return newest


def no_image(device: str) -> StudioError:
    """Return the error of a device that gives no image."""
    return StudioError(
        "picture.none", "{device} gives no image: plug it in again, or close what else uses it", device=device
    )

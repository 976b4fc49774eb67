"""A depth image that points are made of."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera

NO_PLACE, NO_IMAGE, DAMAGED = "no_place", "no_image", "damaged"
"""Why a camera has no points: no calibration knows it, there is no image of this instant, it cannot be read."""

READING, UNREADABLE = "reading", "unreadable"
"""Why no camera has: the take is being read, or cannot be."""


@dataclass(frozen=True, eq=False)
class DepthSeen:
    """A camera's depth image and its place.

    Attributes:
        key: another one for every other image of the camera.
        depth_mm: z per pixel [mm], shape (height, width).
        T_stage_camera: 4x4, camera points to stage points [m].
    """

    key: int
    camera: DepthCamera
    depth_mm: NDArray[np.uint16]
    T_stage_camera: NDArray[np.float64]


class DepthImages(Protocol):
    """Depth images of several cameras; call it from one thread."""

    @property
    def cameras(self) -> tuple[str, ...]:
        """Cameras that have depth."""
        ...

    def at(self, name: str, time_s: float) -> DepthSeen | str:
        """Return a camera's image of a stage time [s], or why there is none: `NO_PLACE`, `NO_IMAGE` or `DAMAGED`."""
        ...

    def close(self) -> None:
        """Let go of what is open."""
        ...


class NoDepth:
    """Of what has none; see `DepthImages`."""

    cameras: tuple[str, ...] = ()

    def at(self, name: str, time_s: float) -> DepthSeen | str:
        del name, time_s
        return NO_IMAGE

    def close(self) -> None:
        """Nothing is open."""

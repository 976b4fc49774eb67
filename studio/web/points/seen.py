"""A depth image that points are made of."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.depth import DepthCamera

NO_PLACE, NO_IMAGE, DAMAGED = "no_place", "no_image", "damaged"
"""Why a camera has no points: no calibration has it, there is no image of this instant, the image is damaged."""

READING, UNREADABLE = "reading", "unreadable"
"""Why no camera has points: the take is being read, or cannot be read."""


@dataclass(frozen=True, eq=False)
class DepthSeen:
    """A camera's depth image and its place.

    Attributes:
        key: differs between the images of a camera.
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
        """Return a camera's image at a stage time [s], or why there is none: `NO_PLACE`, `NO_IMAGE` or `DAMAGED`."""
        ...

    def close(self) -> None:
        """Close open files."""
        ...


class NoDepth:
    """Depth images of a source without any; see `DepthImages`."""

    cameras: tuple[str, ...] = ()

    def at(self, name: str, time_s: float) -> DepthSeen | str:
        del name, time_s
        return NO_IMAGE

    def close(self) -> None:
        """Do nothing: nothing is open."""

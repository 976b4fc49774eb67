"""Pictures of videos and webcams, upright and in the size in which landmarks are read."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.pictures.poses import WORKING_SIDE

if TYPE_CHECKING:
    import av


@dataclass(frozen=True)
class SmallPicture:
    """A picture, upright, reduced where it is larger than needed.

    Attributes:
        image: RGB, uint8, shape (rows, columns, 3).
        width, height: of the whole picture, upright [pixels].
    """

    image: NDArray[np.uint8]
    width: int
    height: int

    @property
    def reduced(self) -> float:
        """Width of a pixel of `image` in pixels of the whole picture."""
        return self.width / self.image.shape[1]

    def whole(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return pixels of `image` as pixels of the whole picture, shape (..., 2)."""
        rows, columns = self.image.shape[:2]
        return (pixels + 0.5) * (self.width / columns, self.height / rows) - 0.5


def small_picture(frame: "av.VideoFrame", *, mirrored: bool = False) -> SmallPicture:
    """Return a decoded frame as a picture, turned upright as its file states.

    Args:
        frame: of a video or a webcam.
        mirrored: the camera swaps left and right, as selfie cameras do; the picture is swapped back.
    """
    factor = max(1, max(frame.width, frame.height) // WORKING_SIDE)
    columns, rows = max(1, round(frame.width / factor)), max(1, round(frame.height / factor))
    reduced = frame.to_ndarray(format="rgb24", width=columns, height=rows, interpolation="AREA")
    quarters = round(frame.rotation / 90) % 4
    image = np.rot90(reduced.astype(np.uint8, copy=False), quarters)
    width, height = (frame.height, frame.width) if quarters % 2 else (frame.width, frame.height)
    return SmallPicture(np.ascontiguousarray(image[:, ::-1] if mirrored else image), width, height)


def whole_picture(frame: "av.VideoFrame", longest: int) -> NDArray[np.uint8]:
    """Return a decoded frame in grey, upright, shape (rows, columns), halved until no side is longer [pixels]."""
    by = 1
    while max(frame.width, frame.height) > by * longest:
        by *= 2
    columns, rows = frame.width // by, frame.height // by
    grey = frame.to_ndarray(format="gray", width=columns, height=rows, interpolation="AREA")
    return np.ascontiguousarray(np.rot90(grey.astype(np.uint8, copy=False), round(frame.rotation / 90) % 4))

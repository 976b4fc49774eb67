"""Squares of a picture, turned so that a person stands upright in them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

_MARGIN = 1.25
"""Side of the square around a person, relative to twice the distance of the two points."""

_PACE = 0.5


@dataclass(frozen=True)
class Region:
    """A square in a picture. Places are in pixels from the picture's upper left corner, not from a pixel's centre.

    Attributes:
        x, y: its middle [pixels].
        side: its width and height [pixels].
        angle: from the picture's axes to its own, clockwise [rad].
    """

    x: float
    y: float
    side: float
    angle: float = 0.0

    @staticmethod
    def whole(width: int, height: int) -> "Region":
        """Return the smallest square around a picture."""
        return Region(0.5 * width, 0.5 * height, float(max(width, height)))

    @staticmethod
    def about(middle: NDArray[np.floating], end: NDArray[np.floating]) -> "Region":
        """Return the region of a person.

        Args:
            middle: the middle of the hips, shape (2,).
            end: a point on the circle around the whole person, in the direction of the head, shape (2,).
        """
        along = np.asarray(end, dtype=np.float64) - middle
        angle = math.atan2(float(along[0]), float(-along[1]))
        return Region(float(middle[0]), float(middle[1]), 2.0 * _MARGIN * float(np.hypot(*along)), angle)

    def towards(self, other: "Region") -> "Region":
        """Return a region between this one and the next picture's; a jittery square would make landmarks jitter."""
        turned = math.remainder(other.angle - self.angle, math.tau)
        return Region(
            self.x + _PACE * (other.x - self.x),
            self.y + _PACE * (other.y - self.y),
            self.side + _PACE * (other.side - self.side),
            self.angle + _PACE * turned,
        )

    def placed(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return points of the square, 0..1, shape (n, 2), as places in the picture."""
        return (points - 0.5) @ (self.side * self.turn().T) + (self.x, self.y)

    def turn(self) -> NDArray[np.float64]:
        """Return the rotation from the square's axes to the picture's, shape (2, 2)."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return np.array([[cosine, -sine], [sine, cosine]])

    def cut(self, picture: Image.Image, side: int) -> NDArray[np.uint8]:
        """Return the square as a picture, shape (side, side, 3); black outside the picture.

        Args:
            picture: RGB.
            side: its size [pixels].
        """
        across, down = self.placed(np.array([[1.0, 0.0], [0.0, 1.0]])) - self.placed(np.zeros((1, 2)))
        first = self.placed(np.zeros((1, 2)))[0]
        rows = [(across[k] / side, down[k] / side, first[k]) for k in (0, 1)]
        cut = picture.transform(
            (side, side), Image.Transform.AFFINE, (*rows[0], *rows[1]), Image.Resampling.BILINEAR
        )
        return np.asarray(cut)

    def usable(self, width: int, height: int) -> bool:
        """Whether the middle is inside a picture of this size, and the side is neither tiny nor huge."""
        largest = 8.0 * max(width, height)
        return 0 <= self.x <= width and 0 <= self.y <= height and 8.0 < self.side < largest

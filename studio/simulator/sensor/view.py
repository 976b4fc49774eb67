"""Input of a noise model: the exact image and its surfaces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Image32 = NDArray[np.float32]


@dataclass(frozen=True)
class SensorView:
    """An exact image of one instant, all arrays of shape (H, W).

    Attributes:
        depth_m: z; inf where there is nothing.
        cosine: of the angle between the ray and the surface normal.
        albedo: reflectivity of the surface, 0..1.
        corner: nearness to another surface of the room, 1 = in the corner, 0 = far away.
    """

    depth_m: Image32
    cosine: Image32
    albedo: Image32
    corner: Image32

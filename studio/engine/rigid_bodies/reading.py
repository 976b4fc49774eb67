"""Another system's reading of a rigid body in its own axes, and their conversion to those of the stage.

Stage axes are right-handed with z up. `y_up` is right-handed with y up (Motive), `z_up` needs no change, and `unity`
is left-handed with y up (VMC, VRChat). The identity rotation there is the identity here.
"""

from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

BodyAxes = Literal["y_up", "z_up", "unity"]


class BodyReading(msgspec.Struct, frozen=True, array_like=True):
    """A rigid body at an instant, in the axes of its system.

    Attributes:
        name: its name in its system.
        position_m: place of its origin [m].
        rotation_xyzw: unit quaternion, in the order of most protocols.
        tracked: whether it was seen; else the place is an old one.
    """

    name: str
    position_m: tuple[float, float, float]
    rotation_xyzw: tuple[float, float, float, float]
    tracked: bool = True


def to_stage_axes(
    positions_m: NDArray[np.float64], rotations_xyzw: NDArray[np.float64], axes: BodyAxes
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return positions, shape (n, 3), and rotations wxyz, shape (n, 4), in axes with z up.

    Args:
        positions_m: in the axes of the system, shape (n, 3).
        rotations_xyzw: shape (n, 4).
        axes: of the system.
    """
    p, q = points_to_stage_axes(positions_m, axes), rotations_xyzw
    if axes == "z_up":
        return p, q[:, [3, 0, 1, 2]]
    if axes == "y_up":
        return p, np.stack([q[:, 3], q[:, 0], -q[:, 2], q[:, 1]], axis=1)
    return p, np.stack([q[:, 3], q[:, 0], q[:, 2], -q[:, 1]], axis=1)


def points_to_stage_axes(points_m: NDArray[np.float64], axes: BodyAxes) -> NDArray[np.float64]:
    """Return points of a system, shape (n, 3), in axes with z up."""
    if axes == "z_up":
        return points_m.copy()
    x = points_m[:, 0] if axes == "y_up" else -points_m[:, 0]
    return np.stack([x, -points_m[:, 2], points_m[:, 1]], axis=1)

"""Rigid bodies (a tracker, a controller, a held object) and markers that another system tracks on the stage."""

from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray


class RigidShape(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A shape about the body's origin.

    Attributes:
        kind: `box`, `cylinder` or `sphere`.
        size_cm: a box's three edges x, y, z; a cylinder's diameter and length; a sphere's diameter.
        axis: axis of a cylinder.
    """

    kind: Literal["box", "cylinder", "sphere"]
    size_cm: tuple[float, ...]
    axis: Literal["x", "y", "z"] = "z"

    @property
    def edges_m(self) -> NDArray[np.float64]:
        """Edges of the box around it along the body's axes [m], shape (3,)."""
        size = np.array(self.size_cm) / 100
        if self.kind == "box":
            return size
        edges = np.repeat(size[0], 3)
        if self.kind == "cylinder":
            edges["xyz".index(self.axis)] = size[1]
        return edges


@dataclass(frozen=True)
class PlacedBody:
    """A rigid body at an instant.

    Attributes:
        name: its name in its system.
        position_m: stage frame [m], shape (3,).
        rotation_wxyz: shape (4,).
        use: `reference`, `prop` or `evidence`; "" = not set.
        shape: None = unknown.
    """

    name: str
    position_m: NDArray[np.float64]
    rotation_wxyz: NDArray[np.float64]
    use: str = ""
    shape: RigidShape | None = None


@dataclass(frozen=True)
class PlacedMarkers:
    """Markers at an instant, stage frame [m].

    Attributes:
        named_m: those with a name, shape (n, 3).
        loose_m: those without, shape (m, 3).
    """

    named_m: NDArray[np.float64]
    loose_m: NDArray[np.float64]

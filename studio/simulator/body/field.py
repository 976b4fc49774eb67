"""Implicit solids: smooth unions of rounded cones, whose surface becomes the performer's skin.

A solid is a field that is negative inside. Its parts belong to groups. Groups 1, 2, ... blend with group 0 but not
with one another, so that adjacent fingers and thighs stay separate.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]
_FAR = 1.0


@dataclass
class Solid:
    """Rounded cones in groups, and planes that cut groups off.

    Attributes:
        blend_m: radius of the blend of a group with group 0 [m].
    """

    blend_m: float = 0.03
    _rows: list[Array] = field(default_factory=list)
    _planes: list[Array] = field(default_factory=list)

    def cone(
        self,
        start: Array,
        end: Array,
        radii_m: tuple[float, float],
        *,
        flat: tuple[float, float, float] = (1.0, 1.0, 1.0),
        group: int = 0,
        blend_m: float = 0.03,
    ) -> None:
        """Add a rounded cone from `start` to `end` [m], with its radius at both ends.

        Args:
            flat: factors of the radii along x, y and z.
            blend_m: radius of the blend with the earlier parts of its group.
        """
        self._rows.append(np.array([*start, *end, *radii_m, *(1 / np.array(flat)), group, blend_m]))

    def ball(
        self, centre: Array, radii_m: tuple[float, float, float], *, group: int = 0, blend_m: float = 0.03
    ) -> None:
        """Add an ellipsoid with its half axes along x, y and z [m]."""
        r = radii_m[0]
        flat = (1.0, radii_m[1] / r, radii_m[2] / r)
        self.cone(centre, centre, (r, r), flat=flat, group=group, blend_m=blend_m)

    def cut(self, group: int, normal: tuple[float, float, float], offset_m: float) -> None:
        """Cut a group off where normal . p < offset_m."""
        self._planes.append(np.array([group, *normal, offset_m]))

    def at(self, points: Array, *, blend_factor: float = 1.0) -> Array:
        """Return the field at points [m], shape (n, 3): about the distance from the surface, shape (n,).

        Args:
            blend_factor: multiplies all blends; above 1 for cloth that spans hollows.
        """
        rows = np.array(self._rows)
        planes = np.array(self._planes).reshape(-1, 5)
        groups = int(rows[:, 11].max()) + 1
        return _field(np.ascontiguousarray(points), rows, planes, groups, self.blend_m, blend_factor)


@compiled
def _smooth_min(a: float, b: float, k: float) -> float:
    """Smooth minimum of two values, rounded over k. Source: Quilez, "Smooth minimum" (quadratic polynomial)."""
    h = max(k - abs(a - b), 0.0)
    return min(a, b) - h * h / (4 * k) if k > 0 else min(a, b)


@compiled
def _cone_field(x: float, y: float, z: float, row: Array) -> float:
    """Distance from a rounded cone, in a space stretched to make its section round."""
    qx, qy, qz = (x - row[0]) * row[8], (y - row[1]) * row[9], (z - row[2]) * row[10]
    bx, by, bz = (row[3] - row[0]) * row[8], (row[4] - row[1]) * row[9], (row[5] - row[2]) * row[10]
    length = bx * bx + by * by + bz * bz
    t = min(max((qx * bx + qy * by + qz * bz) / length, 0.0), 1.0) if length > 0 else 0.0
    square = (qx - t * bx) ** 2 + (qy - t * by) ** 2 + (qz - t * bz) ** 2
    return square**0.5 - (row[6] + t * (row[7] - row[6]))


@compiled
def _field(points: Array, rows: Array, planes: Array, groups: int, blend: float, factor: float) -> Array:
    out = np.empty(len(points))
    value = np.empty(groups)
    for n in range(len(points)):
        value[:] = _FAR
        for k in range(len(rows)):
            group = int(rows[k, 11])
            distance = _cone_field(points[n, 0], points[n, 1], points[n, 2], rows[k])
            if value[group] < _FAR:
                distance = _smooth_min(value[group], distance, rows[k, 12] * factor)
            value[group] = min(distance, _FAR)
        for k in range(len(planes)):
            group = int(planes[k, 0])
            side = planes[k, 4] - planes[k, 1] * points[n, 0] - planes[k, 2] * points[n, 1]
            value[group] = max(value[group], side - planes[k, 3] * points[n, 2])
        least = value[0]
        for group in range(1, groups):
            least = min(least, _smooth_min(value[0], value[group], blend * factor))
        out[n] = least
    return out

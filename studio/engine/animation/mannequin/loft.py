"""Lofts: closed surfaces through a row of sections, and profiles of radii and weights along them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sections:
    """A row of R closed sections, each a superellipse whose front and back may differ in depth.

    Attributes:
        centres: shape (R, 3).
        across, front: unit axes of each section, shape (R, 3); across x front points along the loft.
        wide: half-width along `across`, shape (R,).
        fore, aft: depths along `front` and against it, shape (R,).
        power: exponent of the outline, 2 = ellipse, more = squarer, shape (R,).
    """

    centres: Array
    across: Array
    front: Array
    wide: Array
    fore: Array
    aft: Array
    power: Array


def loft(sections: Sections, sectors: int) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Return points (V, 3), triangles (T, 3), and each point's section (V,).

    The first and the last section shrink to a point each, so that the surface is closed.
    """
    angle = 2 * np.pi * np.arange(sectors) / sectors
    c, s = np.cos(angle), np.sin(angle)
    power = sections.power[:, None]
    norm = (np.abs(c) ** power + np.abs(s) ** power) ** (-1.0 / power)  # (R, sectors)
    depth = np.where(s >= 0, sections.fore[:, None], sections.aft[:, None])
    ring = (
        sections.centres[:, None]
        + (sections.wide[:, None] * norm * c)[..., None] * sections.across[:, None]
        + (depth * norm * s)[..., None] * sections.front[:, None]
    )
    count = len(ring)
    points = np.concatenate([sections.centres[:1], ring[1:-1].reshape(-1, 3), sections.centres[-1:]])
    section = np.concatenate([[0], np.repeat(np.arange(1, count - 1), sectors), [count - 1]])
    return points, _triangles(count - 2, sectors), section


def _triangles(rings: int, sectors: int) -> NDArray[np.int64]:
    """Triangles of `rings` rings between two poles, facing outwards where across x front points along the loft."""
    j = np.arange(sectors)
    k = (j + 1) % sectors
    last = 1 + rings * sectors
    out = [np.stack([np.zeros_like(j), 1 + k, 1 + j], axis=1)]
    for i in range(rings - 1):
        a, b = 1 + i * sectors + j, 1 + i * sectors + k
        out += [np.stack([a, b, b + sectors], axis=1), np.stack([a, b + sectors, a + sectors], axis=1)]
    base = last - sectors
    out.append(np.stack([base + j, base + k, np.full_like(j, last)], axis=1))
    return np.concatenate(out)


def course(knots: list[tuple[float, float]], at: Array) -> Array:
    """Return a smooth profile through (place, value) without overshoot, at other places; constant beyond both
    ends."""
    from scipy.interpolate import PchipInterpolator  # slow to load: not at the start of the server

    places, values = np.array(knots, dtype=np.float64).T
    return PchipInterpolator(places, values)(np.clip(at, places[0], places[-1]))


def dome(at: Array, start: float, stop: float, start_cap: float, stop_cap: float) -> Array:
    """Return the factor that rounds a loft off within `start_cap` of its start and `stop_cap` of its end."""
    out = np.ones_like(at)
    for distance, cap in ((at - start, start_cap), (stop - at, stop_cap)):
        share = np.clip(1.0 - distance / cap, 0.0, 1.0)
        out *= np.sqrt(1.0 - share**2)
    return out


def capped_places(
    start: float, stop: float, start_cap: float, stop_cap: float, between: int, *, hidden: int = 0
) -> Array:
    """Return places along a loft, dense at its rounded ends, where the surface turns most.

    `hidden` of the ends, the start first, lie inside other parts and need few places.
    """
    turn, coarse = np.array([0.0, 0.04, 0.14, 0.32, 0.62]), np.array([0.0, 0.32])
    return np.concatenate(
        [
            start + start_cap * (coarse if hidden > 0 else turn),
            np.linspace(start + start_cap, stop - stop_cap, between),
            (stop - stop_cap * (coarse if hidden > 1 else turn))[::-1],
        ]
    )


def smoothstep(at: Array, centre: float, half_width: float) -> Array:
    """Return a profile from 0 to 1 around `centre`, smooth at both ends."""
    t = np.clip((at - centre) / (2 * half_width) + 0.5, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)

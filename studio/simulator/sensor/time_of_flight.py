"""Noise of a time-of-flight camera on an exact image."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.simulator.sensor.sensors import Sensor, TimeOfFlight
from studio.simulator.sensor.view import Image32, SensorView

_CONTRAST = 2.5
"""Largest ratio of the light from both sides of an edge, because gains differ between pixels."""

_JUMP_M = 0.06
"""Smallest depth difference of neighbours at an edge; at least 3 % of the distance."""


def measure(sensor: Sensor, view: SensorView, rng: np.random.Generator) -> NDArray[np.uint16]:
    """Return the depth image [mm], shape (H, W); 0 = no reading.

    Noise grows with distance and incidence and falls with the amplitude of the returned light. A pixel at an edge
    mixes front and back by their amplitudes (flying pixel) or has no reading. In corners, light arrives by two
    paths, so the depth is too large.
    """
    family = sensor.family
    assert isinstance(family, TimeOfFlight)
    shape = view.depth_m.shape
    return _measure(
        view.depth_m,
        view.cosine,
        view.albedo,
        view.corner,
        np.array([*family.noise_mm, family.grazing_mm, family.flying, family.lost_at_edge, family.multipath_mm,
                  family.least_signal, *sensor.range_m]),
        rng.standard_normal(shape, dtype=np.float32),
        rng.random(shape, dtype=np.float32),
    )  # fmt: skip


@compiled
def _edge(depth: Image32, row: int, column: int) -> tuple[bool, float, int, int]:
    """Whether a pixel lies at an edge, and the neighbour that differs most."""
    z = depth[row, column]
    most, r, c = 0.0, row, column
    for k in range(4):
        i = row + (1 if k == 0 else -1 if k == 1 else 0)
        j = column + (1 if k == 2 else -1 if k == 3 else 0)
        if 0 <= i < depth.shape[0] and 0 <= j < depth.shape[1]:
            gap = min(abs(depth[i, j] - z), 20.0)
            if gap > most:
                most, r, c = gap, i, j
    return most > max(_JUMP_M, 0.03 * z), most, r, c


@compiled
def _measure(
    depth: Image32,
    cosine: Image32,
    albedo: Image32,
    corner: Image32,
    family: NDArray[np.float64],
    noise: Image32,
    chance: Image32,
) -> NDArray[np.uint16]:
    c0, c1, c2, grazing, flying, lost, multipath, least, near, far = family
    out = np.zeros(depth.shape, np.uint16)
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            z = depth[row, column]
            if not near * 0.5 < z < 30.0:
                continue
            cos = max(cosine[row, column], 0.02)
            signal = albedo[row, column] * cos / (z * z)
            draw = chance[row, column]
            edge, _gap, r, c = _edge(depth, row, column)
            if edge:
                if draw < lost:
                    continue
                if draw < lost + flying:
                    share = (draw - lost) / flying
                    other = depth[r, c]
                    if other < 30.0:
                        back = albedo[r, c] * max(cosine[r, c], 0.02) / (other * other)
                        back = min(max(back, signal / _CONTRAST), signal * _CONTRAST)
                        weight = share * signal / (share * signal + (1 - share) * back)
                        z = weight * z + (1 - weight) * other
                    signal = 0.5 * signal
            if signal < least * (0.7 + 0.6 * draw):
                continue
            angle = min(np.arccos(min(cos, np.float32(1.0))), 1.45)
            sd = c0 + c1 * z + c2 * z * z + grazing * z**1.5 * angle**2 / (np.pi / 2 - angle) ** 2
            sd *= (0.5 / max(albedo[row, column], 0.03)) ** 0.5
            z_mm = 1e3 * z + sd * noise[row, column] + multipath * corner[row, column]
            if near * 1e3 <= z_mm <= far * 1e3:
                out[row, column] = np.uint16(z_mm + 0.5)
    return out

"""One skeleton from all placed cameras over the calibration part, from which floor and performer are measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.noise import rays, sigmas
from studio.engine.calibration.cameras.pairs import Track, sample
from studio.engine.calibration.cameras.refine import PlacedCamera
from studio.engine.calibration.cameras.swaps import exchange

_OUTLIER_M = 0.15
_OUTLIER_WINDOW = 15
_SURE = 0.3
"""A joint is sure from this share of its usual weight; a joint that is hidden from all cameras has a sixteenth."""


@dataclass(frozen=True)
class Walk:
    """All cameras' joints at common instants in one frame, without the depth bias and without spikes.

    Attributes:
        times_s: instants on the reference track's clock [s], shape (instant_count,).
        positions: by camera [m], shape (camera_count, instant_count, 21, 3); NaN = unseen or an outlier.
        weights: inverse variance, shape (camera_count, instant_count, 21), 0 where NaN.
        merged: weighted mean of the cameras [m], shape (instant_count, 21, 3); NaN = no camera.
    """

    times_s: NDArray[np.float64]
    positions: NDArray[np.float64]
    weights: NDArray[np.float64]
    merged: NDArray[np.float64]

    def smooth(self, over_s: float = 0.5) -> NDArray[np.float64]:
        """Return the sure joints as running medians over a time [m], shape (instant_count, 21, 3)."""
        step_s = float(np.median(np.diff(self.times_s))) if len(self.times_s) > 1 else 1.0
        return running_median(self.sure(), 2 * round(over_s / 2 / step_s) + 1)

    def sure(self, camera: int | None = None) -> NDArray[np.float64]:
        """Return joints [m], shape (instant_count, 21, 3), NaN where they are less sure than usual.

        Args:
            camera: index of the camera; the merged joints where None.
        """
        weights = self.weights.sum(axis=0) if camera is None else self.weights[camera]
        out = (self.merged if camera is None else self.positions[camera]).copy()
        for j in range(out.shape[1]):
            seen = weights[:, j] > 0
            if seen.any():
                out[weights[:, j] < _SURE * np.median(weights[seen, j]), j] = np.nan
        return out

    def moved(self, T: NDArray[np.float64]) -> "Walk":
        """Return the walk transformed by the rigid transform `T`."""
        return Walk(
            self.times_s, transform_points(T, self.positions), self.weights, transform_points(T, self.merged)
        )


def running_median(positions: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Return running medians over `window` instants of joints, shape (instant_count, 21, 3); gaps are
    interpolated."""
    from scipy.ndimage import median_filter  # slow to load: not at the start of the server

    smooth = positions.copy()
    for j in range(positions.shape[1]):
        seen = np.flatnonzero(np.isfinite(positions[:, j, 0]))
        if len(seen) == 0:
            continue
        for k in range(3):  # one row at a time, for which the filter is 3 to 10 times as fast
            filled = np.interp(np.arange(len(positions)), seen, positions[seen, j, k])
            smooth[:, j, k] = median_filter(filled, size=window, mode="nearest")
    return smooth


def merge(
    tracks: list[Track],
    cameras: list[PlacedCamera],
    times_s: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    depth_bias_m: float,
) -> Walk:
    """Return the cameras' joints at the instants in the reference camera's frame, and their weighted mean.

    A camera's joint that is over 15 cm from the median over time and cameras is left out.
    """
    shape = (len(tracks), len(times_s), tracks[0].positions.shape[1])
    positions, weights = np.full((*shape, 3), np.nan), np.zeros(shape)
    for i, (track, camera) in enumerate(zip(tracks, cameras, strict=True)):
        local, confidence = sample(track, camera.clock.device_s(times_s))
        local, confidence = exchange(local, swapped[i]), exchange(confidence, swapped[i])
        along, across = sigmas(local, confidence)
        weights[i] = np.nan_to_num(3.0 / (along**2 + 2 * across**2))
        positions[i] = transform_points(camera.T, local + depth_bias_m * rays(local))
    first = running_median(_mean(positions, weights), _OUTLIER_WINDOW)
    far = ~(np.linalg.norm(positions - first, axis=3) < _OUTLIER_M)
    moving = np.linalg.norm(np.gradient(first, axis=0), axis=2) * 8 if len(times_s) > 1 else 0.0
    far &= ~(np.linalg.norm(positions - first, axis=3) < _OUTLIER_M + moving)
    positions[far], weights[far] = np.nan, 0.0
    return Walk(times_s, positions, weights, _mean(positions, weights))


def _mean(positions: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    total = weights.sum(axis=0)
    summed = (np.nan_to_num(positions) * weights[..., None]).sum(axis=0)
    return np.divide(summed, total[..., None], out=np.full_like(summed, np.nan), where=total[..., None] > 0)

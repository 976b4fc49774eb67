"""Joint placement of all cameras: their transforms and clocks, and the walk that they show."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.first import Candidate
from studio.engine.calibration.cameras.merge import Walk, merge
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import Track, grid, sample
from studio.engine.calibration.cameras.refine import BIAS_PRIOR_M, PlacedCamera, Refined, refine
from studio.engine.calibration.cameras.swaps import exchange, find_swaps
from studio.engine.calibration.quality import residuals as quality
from studio.engine.calibration.quality.steadiness import CameraShift, largest_shifts


@dataclass(frozen=True)
class Placements:
    """All cameras' placements, the reference first: from all frames, from even 5 s blocks, and the resulting walk."""

    names: list[str]
    tracks: list[Track]
    times_s: NDArray[np.float64]
    swapped: NDArray[np.bool_]
    whole: Refined
    even: Refined
    walk: Walk
    shifts: list[CameraShift]


def fit_together(cameras: list[Candidate]) -> Placements:
    """Return all cameras' placements, starting from their first placements."""
    tracks = [camera.track for camera in cameras]
    start = [camera.placed for camera in cameras]
    clocks = np.array([camera.fit_clock for camera in cameras])
    times = grid(tracks[0])
    swapped = swaps_between(tracks, start, times, BIAS_PRIOR_M)
    whole = even = Refined(start, BIAS_PRIOR_M, np.zeros(len(start)))
    if len(cameras) > 1:

        def fit(best: Refined, part: NDArray[np.bool_] | slice, iterations: int) -> Refined:
            return refine(
                tracks, best.cameras, times[part], swapped[:, part],
                depth_bias_m=best.depth_bias_m, fit_clocks=clocks, iterations=iterations,
            )  # fmt: skip

        whole = fit(whole, slice(None, None, 3), 4)
        swapped = swaps_between(tracks, whole.cameras, times, whole.depth_bias_m)
        whole = fit(whole, slice(None, None, 2), 6)
        even = fit(whole, quality.even_blocks(times) & (np.arange(len(times)) % 2 == 0), 4)
    walk = merge(tracks, whole.cameras, times, swapped, whole.depth_bias_m)
    joints = joints_of(tracks, whole.cameras, times, whole.depth_bias_m)
    ordered = np.array([exchange(mine, swap) for mine, swap in zip(joints, swapped, strict=True)])
    shifts = largest_shifts(ordered, times, quality.BLOCK_S)
    return Placements([camera.name for camera in cameras], tracks, times, swapped, whole, even, walk, shifts)


def swaps_between(
    tracks: list[Track], cameras: list[PlacedCamera], times_s: NDArray[np.float64], depth_bias_m: float
) -> NDArray[np.bool_]:
    """Return where each camera's left and right are swapped, shape (camera_count, instant_count)."""
    return find_swaps(joints_of(tracks, cameras, times_s, depth_bias_m))


def joints_of(
    tracks: list[Track], cameras: list[PlacedCamera], times_s: NDArray[np.float64], depth_bias_m: float
) -> NDArray[np.float64]:
    """Return the cameras' joints in the reference's frame [m], shape (camera_count, instant_count, 21, 3)."""
    points = [
        transform_points(camera.T, unbiased(sample(track, camera.clock.device_s(times_s))[0], depth_bias_m))
        for track, camera in zip(tracks, cameras, strict=True)
    ]
    return np.array(points)

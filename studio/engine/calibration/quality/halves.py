"""Agreement of the transforms of two halves of a walk: each camera fitted on even and on odd 5 s blocks.

The halves test transforms only: clocks, the depth bias and each camera's joint offsets by heading come from the whole
walk. A tracker that sees a side of the body places its joints some centimetres away from one that sees the front, so
halves that show different sides would differ for that reason.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import transform_points
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import Track, sample
from studio.engine.calibration.cameras.refine import Refined, refine
from studio.engine.calibration.cameras.swaps import exchange
from studio.engine.calibration.quality.residuals import disagreement, even_blocks
from studio.engine.model.joints import INDEX

_ORDER = 2
_RIDGE = 0.1
"""Weight of the ridge on the harmonics; it damps them at headings that were hardly shown."""
_MIN_INSTANTS = 100
_ITERATIONS = 6


@dataclass(frozen=True)
class Halves:
    """Difference of a camera's placements on the halves: over the walked stage [m], and in angle [degrees]."""

    metres: float
    degrees: float


def compare_halves(
    tracks: list[Track],
    whole: Refined,
    times_s: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    walk: Walk,
    T_stage: NDArray[np.float64],
) -> list[Halves]:
    """Return the disagreement of every camera's halves; the reference's is 0.

    Args:
        tracks: the cameras, the reference first; whole: their placement by the whole walk.
        times_s: instants on the reference's clock [s], shape (instant_count,).
        swapped: where left and right are swapped, shape (camera_count, instant_count).
        walk: at these instants, in the stage frame.
        T_stage: stage <- reference.
    """
    if len(tracks) == 1:
        return [Halves(0.0, 0.0)]
    offsets = _offsets(tracks, whole, times_s, swapped, _heading(walk.merged))
    even = even_blocks(times_s)
    a, b = (
        refine(
            tracks,
            whole.cameras,
            times_s[half],
            swapped[:, half],
            depth_bias_m=whole.depth_bias_m,
            fit_clocks=np.zeros(len(tracks), dtype=bool),
            fit_bias=False,
            offsets_m=offsets[:, half],
            iterations=_ITERATIONS,
        )
        for half in (even, ~even)
    )
    hips = walk.merged[:, INDEX["hips"]]
    return [
        Halves(*disagreement(one.T, other.T, T_stage, hips))
        for one, other in zip(a.cameras, b.cameras, strict=True)
    ]


def _heading(joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the performer's heading [rad], shape (instant_count,); NaN without shoulders and hips."""
    shoulders, hips = (
        joints[:, INDEX[f"left_{name}"], :2] - joints[:, INDEX[f"right_{name}"], :2]
        for name in ("shoulder", "hip")
    )
    across = np.where(np.isfinite(shoulders), shoulders, hips)
    return np.arctan2(across[:, 1], across[:, 0])


def _offsets(
    tracks: list[Track],
    whole: Refined,
    times_s: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    heading: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the offsets of each camera's joints to the reference's, as a smooth function of the heading [m].

    A robust ridge regression per camera and joint on a constant and two harmonics.

    Returns:
        Shape (camera_count, instant_count, 21, 3), in the reference camera's frame; 0 where too little was seen.
    """
    points = [
        transform_points(
            camera.T, unbiased(_ordered(track, camera.clock.device_s(times_s), swap), whole.depth_bias_m)
        )
        for track, camera, swap in zip(tracks, whole.cameras, swapped, strict=True)
    ]
    known = np.isfinite(heading)
    columns = [np.ones(len(times_s))]
    for k in range(1, _ORDER + 1):
        columns += [np.cos(k * heading), np.sin(k * heading)]
    X = np.where(known[:, None], np.column_stack(columns), 0.0)
    out = np.zeros((len(tracks), *points[0].shape))
    for camera in range(1, len(tracks)):
        for joint in range(points[0].shape[1]):
            difference = points[0][:, joint] - points[camera][:, joint]
            seen = known & np.isfinite(difference).all(axis=1)
            if seen.sum() >= _MIN_INSTANTS:
                out[camera, :, joint] = X @ _robust_ridge(X[seen], difference[seen])
    return out


def _ordered(track: Track, device_s: NDArray[np.float64], swap: NDArray[np.bool_]) -> NDArray[np.float64]:
    return exchange(sample(track, device_s)[0], swap)


def _robust_ridge(X: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return coefficients, shape (column_count, 3); weights by Geman and McClure, the constant is not shrunk."""
    shrink = _RIDGE * len(X) * np.eye(X.shape[1])
    shrink[0, 0] = 0.0
    beta = np.zeros((X.shape[1], y.shape[1]))
    beta[0] = np.median(y, axis=0)
    for _ in range(8):
        error = np.linalg.norm(y - X @ beta, axis=1)
        weight = (1.0 + (error / (3.0 * max(float(np.median(error)), 1e-3))) ** 2) ** -2
        weighted = X * weight[:, None]
        beta = np.linalg.solve(weighted.T @ X + shrink, weighted.T @ y)
    return beta

"""Figures of a calibration: residuals against the reference, agreement of two halves, coverage."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import fit_rigid, invert_transform, transform_points
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import Track, sample
from studio.engine.calibration.cameras.refine import PlacedCamera
from studio.engine.calibration.cameras.swaps import exchange
from studio.engine.model.joints import INDEX

BLOCK_S = 5.0
_CELL_M = 0.5


@dataclass(frozen=True)
class Residuals:
    """Distances between a camera's joints and the reference's: median and 95 % [m], and their number.

    `agreement_m` is the median after left and right were corrected. All are None where there are no pairs.
    `median_px`: of a camera without depth, the same in its picture [pixel].
    """

    median_m: float | None
    p95_m: float | None
    agreement_m: float | None
    pairs: int
    median_px: float | None = None


def even_blocks(times_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which instants lie in even 5 s blocks; the others lie in odd ones."""
    return (np.floor(times_s / BLOCK_S).astype(int) % 2) == 0


def residuals(
    tracks: tuple[Track, Track],
    cameras: tuple[PlacedCamera, PlacedCamera],
    times_s: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    depth_bias_m: float,
) -> Residuals:
    """Return the distances of a camera's joints from the reference's of the same name, at common instants.

    Median and 95 % include every joint that both report, also outliers, uncertain joints and frames in which a camera
    swapped left and right. The depth bias is corrected in them, because it is part of the calibration.

    Args:
        tracks, cameras: the reference and the camera, in this order.
        times_s: instants on the reference's clock [s], shape (instant_count,).
        swapped: where the camera's left and right are swapped, shape (instant_count,).
        depth_bias_m: the calibration's.
    """
    here, there = (
        transform_points(camera.T, unbiased(sample(track, camera.clock.device_s(times_s))[0], depth_bias_m))
        for track, camera in zip(tracks, cameras, strict=True)
    )
    distance = _finite(np.linalg.norm(here - there, axis=2))
    ordered = _finite(np.linalg.norm(here - exchange(there, swapped), axis=2))
    if len(distance) == 0 or len(ordered) == 0:
        return Residuals(None, None, None, 0)
    p95 = float(np.percentile(distance, 95))
    return Residuals(float(np.median(distance)), p95, float(np.median(ordered)), len(distance))


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[np.isfinite(values)]


def disagreement(
    T_a: NDArray[np.float64],
    T_b: NDArray[np.float64],
    T_stage: NDArray[np.float64],
    hips: NDArray[np.float64],
) -> tuple[float, float]:
    """Return the difference of two placements of one camera: RMS over the walked stage [m], and angle [degrees].

    The stage is the range of the performer's hips (2 to 98 % along each axis), from the floor to 2 m.

    Args:
        T_a, T_b: reference <- camera.
        T_stage: stage <- reference; its floor is at 0.
        hips: the performer's in the stage frame [m], shape (instant_count, 3); NaN = unseen.
    """
    seen = hips[np.isfinite(hips).all(axis=1), :2]
    low, high = np.percentile(seen, [2, 98], axis=0) if len(seen) else np.zeros((2, 2))
    axes = [np.linspace(low[k], high[k], 4) for k in range(2)]
    stage = np.stack(np.meshgrid(*axes, np.linspace(0.0, 2.0, 3), indexing="ij"), axis=-1).reshape(-1, 3)
    in_camera = transform_points(invert_transform(T_stage @ T_a), stage)
    moved = transform_points(T_b, in_camera) - transform_points(T_a, in_camera)
    cosine = (np.trace(T_a[:3, :3].T @ T_b[:3, :3]) - 1.0) / 2.0
    angle_deg = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return float(np.sqrt((moved**2).sum(axis=1).mean())), angle_deg


def coverage(walk: Walk) -> NDArray[np.float64]:
    """Return the share of the walked floor, in cells of half a metre, where each camera saw the hips.

    Args:
        walk: in the stage frame.

    Returns:
        Shape (camera_count,), 0..1.
    """
    hips = walk.merged[:, INDEX["hips"], :2]
    somewhere = np.isfinite(hips).all(axis=1)
    _, cells = np.unique(np.floor(hips[somewhere] / _CELL_M), axis=0, return_inverse=True)
    seen = np.isfinite(walk.positions[:, somewhere, INDEX["hips"], 0])
    walked = max(len(np.unique(cells)), 1)
    return np.array([len(np.unique(cells[mine])) / walked for mine in seen])


def lowest_feet(positions: NDArray[np.float64]) -> float | None:
    """Return the usual height of a camera's lower ankle or toe when it is low [m]; None where it saw no feet.

    Args:
        positions: the camera's joints in the stage frame [m], shape (instant_count, 21, 3); NaN = unseen.
    """
    feet = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "toe")]
    heights = _finite(positions[:, feet, 2])
    return float(np.percentile(heights, 10)) if len(heights) else None


def identity_error(positions: NDArray[np.float64]) -> float | None:
    """Return the deviation of the reference camera, fitted to itself, from the identity: the thesis's check.

    It is the largest difference of an entry of the 4x4 transform; closed-form fits of equal points cannot fail it.

    Args:
        positions: the reference's joints [m], shape (instant_count, 21, 3); NaN = unseen.

    Source: D. Menard, thesis, 2014: within 10e-3 of the identity.
    """
    points = positions.reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 4:
        return None
    return float(np.abs(fit_rigid(points, points, np.ones(len(points))) - np.eye(4)).max())

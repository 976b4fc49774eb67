"""How good a calibration is: residuals, agreement of two halves, coverage, and the verdict with its reasons."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.noise import unbiased
from studio.engine.calibration.pairs import Track, sample
from studio.engine.calibration.refine import Placed
from studio.engine.geometry import transform_points
from studio.engine.joints import INDEX

BLOCK_S = 5.0
MIN_PAIRS = 2000
MIN_SPREAD_M = 0.25
GOOD_BLOCKS_M, GOOD_BLOCKS_DEG = 0.01, 0.5
REFUSED_BLOCKS_M, REFUSED_BLOCKS_DEG = 0.06, 3.0
GOOD_MEDIAN_M, REFUSED_MEDIAN_M = 0.10, 0.20
_CELL_M = 0.5


@dataclass(frozen=True)
class Residuals:
    """Distances between a camera's joints and the reference's: median and 95 % [m], and their number."""

    median_m: float
    p95_m: float
    pairs: int


def even_blocks(times_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which instants lie in even 5 s blocks; the others lie in odd ones."""
    return (np.floor(times_s / BLOCK_S).astype(int) % 2) == 0


def residuals(
    tracks: tuple[Track, Track],
    cameras: tuple[Placed, Placed],
    times_s: NDArray[np.float64],
    depth_bias_m: float,
) -> Residuals:
    """Return how far a camera's joints are from the reference's of the same name, at common instants.

    Every joint that both report counts, also outliers, unsure joints and frames in which a camera exchanged left
    and right. The depth bias is corrected in it: it is part of the calibration.

    Args:
        tracks, cameras: the reference and the camera, in this order.
        times_s: instants on the reference's clock [s], shape (instant_count,).
        depth_bias_m: the calibration's.
    """
    points = []
    for track, camera in zip(tracks, cameras, strict=True):
        local, _ = sample(track, camera.clock.device_s(times_s))
        points.append(transform_points(camera.T, unbiased(local, depth_bias_m)))
    distance = np.linalg.norm(points[0] - points[1], axis=2)
    distance = distance[np.isfinite(distance)]
    if len(distance) == 0:
        return Residuals(float("nan"), float("nan"), 0)
    return Residuals(float(np.median(distance)), float(np.percentile(distance, 95)), len(distance))


def disagreement(
    T_a: NDArray[np.float64], T_b: NDArray[np.float64], T_stage: NDArray[np.float64]
) -> tuple[float, float]:
    """Return how far two placements of one camera differ: RMS over a 3 x 3 x 2 m stage [m], and angle [degrees].

    Args:
        T_a, T_b: reference <- camera.
        T_stage: stage <- reference; the stage is centred on its origin and stands on its floor.
    """
    axes = np.linspace(-1.5, 1.5, 4), np.linspace(-1.5, 1.5, 4), np.linspace(0.0, 2.0, 3)
    stage = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    in_camera = transform_points(np.linalg.inv(T_stage @ T_a), stage)
    moved = transform_points(T_b, in_camera) - transform_points(T_a, in_camera)
    cosine = (np.trace(T_a[:3, :3].T @ T_b[:3, :3]) - 1.0) / 2.0
    return float(np.sqrt((moved**2).sum(axis=1).mean())), float(
        np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    )


def coverage(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of the walked floor, in cells of half a metre, where each camera saw the body.

    Args:
        positions: stage frame [m], shape (camera_count, instant_count, 21, 3); NaN = unseen.
    """
    hips = positions[:, :, INDEX["hips"], :2]
    cells = np.floor(hips / _CELL_M)
    seen = [
        {tuple(cell) for cell in camera[np.isfinite(camera).all(axis=1)].astype(int).tolist()}
        for camera in cells
    ]
    walked = set().union(*seen)
    return np.array([len(mine) / max(len(walked), 1) for mine in seen])


@dataclass(frozen=True)
class Facts:
    """What a camera's verdict rests on; lengths in metres; None = not measured."""

    pairs: int | None = None
    spread_m: NDArray[np.float64] | None = None
    median_m: float | None = None
    blocks: tuple[float, float] | None = None
    camera_height_m: float | None = None
    upside_down: bool = False
    mirrored: bool = False
    clock_reason: str = ""
    offset_sd_s: float = 0.0


def verdict(facts: Facts) -> tuple[str, tuple[str, ...]]:
    """Return `good`, `usable` or `refused`, and why, for one camera."""
    refused, doubts = [], []
    if facts.mirrored:
        refused.append("the stream is mirrored: switch the camera's mirror mode off and record again")
    if facts.pairs is not None and facts.pairs < MIN_PAIRS:
        refused.append(
            f"only {facts.pairs} joint pairs with the reference camera, at least {MIN_PAIRS} are needed: "
            "walk for longer where both cameras see you"
        )
    if facts.spread_m is not None and facts.spread_m[1] < MIN_SPREAD_M:
        refused.append(
            "too little spread: walk through the whole stage, forwards and sideways, not on one spot or line"
        )
    if facts.camera_height_m is not None and facts.camera_height_m < 0.0:
        refused.append(
            f"the camera comes out {-facts.camera_height_m * 100:.0f} cm under the floor: "
            "walk with both feet in view and calibrate again"
        )
    if facts.upside_down:
        refused.append(
            "the camera comes out tilted by more than 60 degrees: mount it upright or check its stream"
        )
    if facts.median_m is not None and facts.median_m > GOOD_MEDIAN_M:
        text = f"joints disagree with the reference camera by {facts.median_m * 100:.0f} cm (median)"
        (refused if facts.median_m > REFUSED_MEDIAN_M else doubts).append(
            f"{text}: let one performer alone walk, in view of both cameras"
        )
    if facts.blocks is not None:
        metres, degrees = facts.blocks
        if metres > GOOD_BLOCKS_M or degrees > GOOD_BLOCKS_DEG:
            gross = metres > REFUSED_BLOCKS_M or degrees > REFUSED_BLOCKS_DEG
            (refused if gross else doubts).append(
                f"fits on even and odd 5 s blocks differ by {metres * 100:.1f} cm and {degrees:.1f} degrees "
                f"(good: {GOOD_BLOCKS_M * 100:.0f} cm and {GOOD_BLOCKS_DEG} degrees): walk for longer"
            )
    if facts.clock_reason:
        doubts.append(
            f"clock offset not found from the motion ({facts.clock_reason}): move livelier, or sync clocks"
        )
    elif facts.offset_sd_s > 0.01:
        doubts.append(f"clock offset known to {facts.offset_sd_s * 1e3:.0f} ms only: move livelier")
    if refused:
        return "refused", tuple(refused + doubts)
    return ("usable", tuple(doubts)) if doubts else ("good", ())

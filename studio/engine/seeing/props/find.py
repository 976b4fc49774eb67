"""Search for a prop in what cameras see, without a known pose."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import rotation_between
from studio.engine.model.rigid_body import RigidShape
from studio.engine.seeing.props.fit import Fitted, PropFit, PropPose
from studio.engine.seeing.props.sight import SeenImage
from studio.engine.seeing.props.solid import axis_of, distances_m, is_long

Array = NDArray[np.float64]

_SEEDS, _CELL_M = 60, 0.05
_BEST = 5
_ON_M, _BESIDE_M = 0.02, 0.06
_SIGMA_M, _SIGMA_RAD = 0.08, 0.5


def find_prop(
    images: Sequence[SeenImage], fit: PropFit, near_m: Array | None = None, *, within_m: float = 0.5
) -> Fitted | None:
    """Return the pose of a prop; None if nothing that is seen has its shape.

    Args:
        images: of one instant.
        near_m: expected place on the stage; None = anywhere.
        within_m: search radius around that place.
    """
    points = np.concatenate([one.points_m[one.weights > 0.5] for one in images])
    eyes = np.concatenate([np.tile(one.eye_m, ((one.weights > 0.5).sum(), 1)) for one in images])
    if near_m is not None:
        kept = np.linalg.norm(points - near_m, axis=1) < within_m + fit.shape.edges_m.max() / 2
        points, eyes = points[kept], eyes[kept]
    if len(points) < 12:
        return None
    seeds = _seeds(points)
    poses = (
        _stick_poses(fit.shape, points, seeds)
        if is_long(fit.shape)
        else _other_poses(fit.shape, points, eyes, seeds)
    )
    poses.sort(key=lambda one: -_quick(fit.shape, points, one))
    found = [
        fit.fit(images, PropPose.still(*one), sigma_m=_SIGMA_M, sigma_rad=_SIGMA_RAD) for one in poses[:_BEST]
    ]
    found.sort(key=lambda one: -one.worth)
    found = [fit.fit(images, one.pose, sigma_m=_SIGMA_M, sigma_rad=_SIGMA_RAD) for one in found[:2]]
    found = [one for one in found if one.holds]
    return max(found, key=lambda one: one.worth, default=None)


def _seeds(points: Array) -> NDArray[np.int64]:
    """Return the indices of representative points, one per cell, evenly chosen."""
    _, first = np.unique(np.floor(points / _CELL_M).astype(int), axis=0, return_index=True)
    chosen = np.unique(np.linspace(0, len(first) - 1, min(_SEEDS, len(first))).round().astype(int))
    return first[chosen]


def _quick(shape: RigidShape, points: Array, pose: tuple[Array, Array]) -> float:
    """Return the number of points on a prop's surface minus those inside it or next to it."""
    d = distances_m(shape, (points - pose[0]) @ pose[1])
    return float((np.abs(d) < _ON_M).sum() - (d < -_ON_M).sum() - ((d > _ON_M) & (d < _BESIDE_M)).sum())


def _stick_poses(shape: RigidShape, points: Array, seeds: NDArray[np.int64]) -> list[tuple[Array, Array]]:
    """Return poses of a stick along the points around each seed, at the ends and in the middle of these points."""
    length, axis = float(shape.edges_m.max()), np.eye(3)[axis_of(shape)]
    poses = []
    for seed in points[seeds]:
        away = np.linalg.norm(points - seed, axis=1)
        for reach in (0.2 * length, 0.4 * length):
            near = points[away < max(reach, 0.06)]
            if len(near) < 6:
                continue
            middle = np.median(near, axis=0)
            way = np.linalg.svd(near - middle, full_matrices=False)[2][0]
            along = (points - middle) @ way
            aside = np.linalg.norm(points - middle - along[:, None] * way, axis=1)
            line = along[(aside < shape.edges_m.min() / 2 + 0.025) & (np.abs(along) < length)]
            if len(line) < 6:
                continue
            starts = np.linspace(line.min() - 0.02, max(line.max() - length, line.min()), 12)
            counts = [((line >= one) & (line <= one + length)).sum() for one in starts]
            low = starts[int(np.argmax(counts))]
            inside = line[(line >= low) & (line <= low + length)]
            turn = rotation_between(axis, way)
            ends = inside.min() + length / 2, inside.max() - length / 2, (inside.min() + inside.max()) / 2
            poses += [(middle + one * way, turn) for one in ends]
    return poses


def _other_poses(
    shape: RigidShape, points: Array, eyes: Array, seeds: NDArray[np.int64]
) -> list[tuple[Array, Array]]:
    """Return poses behind each seed, with each face of the shape towards it."""
    half, poses = shape.edges_m / 2, []
    for seed, eye in zip(points[seeds], eyes[seeds], strict=True):
        ray = (seed - eye) / np.linalg.norm(seed - eye)
        if shape.kind == "sphere":
            poses.append((seed + half[0] * ray, np.eye(3)))
            continue
        near = points[np.linalg.norm(points - seed, axis=1) < max(0.08, half.min())]
        normal = np.linalg.svd(near - near.mean(axis=0))[2][2] if len(near) > 5 else -ray
        normal = normal if normal @ ray < 0 else -normal
        about = points[np.linalg.norm(points - seed, axis=1) < half.max()].mean(axis=0)
        flat = about - ((about - seed) @ normal) * normal
        for axis in range(3):
            base = rotation_between(np.eye(3)[axis], normal)
            for angle in np.arange(4) * np.pi / 8 if shape.kind == "box" else (0.0, np.pi / 2):
                c, s = np.cos(angle), np.sin(angle)
                i, j = (axis + 1) % 3, (axis + 2) % 3
                spin = np.eye(3)
                spin[i, i], spin[i, j], spin[j, i], spin[j, j] = c, -s, s, c
                for middle in (seed, flat):
                    poses.append((middle - half[axis] * normal, base @ spin))
    return poses

"""A reference of markers, with constant offsets from the joint centres in the axes of their bones.

The offsets are unknown. A robust fit of the offsets and the rigid transform brings the markers as near to the solve
as possible. The fit also removes the constant part of the solve's error; figures against markers state the fitted
offsets (`marker_offsets_mm`).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import fit_rigid, make_transform
from studio.engine.metrics.reference.canonical import canonical_columns, canonical_positions
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.model.joints import INDEX
from studio.engine.model.poses import Poses

OFFSET_SIGMA_M = 0.10
"""Prior of a marker's distance from its joint; it keeps components that the motion does not determine at 0."""

_ROUNDS = 40
_MOST_SAMPLES = 600


def fit_joint_centres(
    poses: Poses,
    markers: Markers,
    *,
    start_s: float | None = None,
    offset_s: float = 0.0,
    drift_ppm: float = 0.0,
) -> tuple[Reference, dict[str, float]]:
    """Return the markers as joint centres, and the distance of each from its joint [mm] by canonical joint.

    Args:
        poses: the solve.
        markers: the reference.
        start_s: stage time before which nothing is compared.
        offset_s, drift_ppm: the reference's clock, as for `matching.match`.

    Raises:
        FormatError: fewer than 3 markers of joints that the solve has, or too little time in common.
    """
    from scipy.interpolate import interp1d  # slow to load: not at the start of the server

    stage = (markers.time_s - offset_s) / (1.0 + drift_ppm * 1e-6)
    first = poses.time_s[0] if start_s is None else max(start_s, float(poses.time_s[0]))
    inside = (stage >= first) & (stage <= poses.time_s[-1])
    if inside.sum() < 10:
        raise FormatError(
            "reference.markers_few_instants",
            "the solve and the markers share fewer than 10 instants; is it the reference of this take?",
        )
    columns = canonical_columns(poses)
    if sum(columns[INDEX[name]] >= 0 for name in markers.joints) < 3:
        raise FormatError(
            "reference.markers_few_joints", "at least 3 markers of joints that the solve has are needed"
        )
    solve = np.full((len(stage), len(markers.joints), 3), np.nan)
    joints = [INDEX[name] for name in markers.joints]
    solve[inside] = interp1d(poses.time_s, canonical_positions(poses)[:, joints], axis=0)(stage[inside])
    turns = markers.rotations if markers.rotations is not None else _turns(poses, markers, stage, inside)
    chosen = np.flatnonzero(inside)[:: max(1, int(inside.sum()) // _MOST_SAMPLES)]
    T, offsets = _fit(
        solve[chosen], markers.positions_m[chosen], turns[chosen], markers.rotations is not None
    )
    carried = (turns @ offsets[..., None])[..., 0]
    centres = (
        markers.positions_m + carried
        if markers.rotations is not None
        else markers.positions_m - carried @ T[:3, :3].T
    )
    length = np.linalg.norm(offsets, axis=1) * 1e3
    return markers.as_reference(centres), {
        name: float(mm) for name, mm in zip(markers.joints, length, strict=True)
    }


def _turns(
    poses: Poses, markers: Markers, stage_s: NDArray[np.float64], inside: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """World rotations of the solve's joints at the markers' instants; NaN outside the solve."""
    out = np.full((len(stage_s), len(markers.joints), 3, 3), np.nan)
    columns = canonical_columns(poses)
    for k, name in enumerate(markers.joints):
        if columns[INDEX[name]] >= 0:
            own = Rotation.from_quat(poses.rotations_wxyz[:, columns[INDEX[name]]], scalar_first=True)
            out[inside, k] = Slerp(poses.time_s, own)(stage_s[inside]).as_matrix()
    return out


def _fit(
    solve: NDArray[np.float64],
    markers: NDArray[np.float64],
    turns: NDArray[np.float64],
    on_markers: bool,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss-Newton on the rigid transform and all offsets, with Cauchy weights.

    Residuals are T p - m - Q o for targets (`on_markers`), T (p + R o) - m for plain markers.

    Returns:
        The 4x4 transform from the stage to the reference, and offsets [m], shape (marker_count, 3).
    """
    valid = np.isfinite(solve).all(axis=2) & np.isfinite(markers).all(axis=2)
    valid &= np.isfinite(turns).all(axis=(2, 3))
    if valid.sum() < 30:
        raise FormatError(
            "reference.markers_offsets",
            "the solve and the markers have too few instants in common to fit their offsets",
        )
    marker = np.nonzero(valid)[1]
    p, m, turn = solve[valid], markers[valid], turns[valid]
    T = fit_rigid(p, m)
    offsets = np.zeros((solve.shape[1], 3))
    count = 6 + offsets.size
    for _ in range(_ROUNDS):
        R = T[:3, :3]
        carried = (turn @ offsets[marker][..., None])[..., 0]
        moved = (p if on_markers else p + carried) @ R.T + T[:3, 3]
        residual = moved - m - (carried if on_markers else 0.0)
        distance = np.linalg.norm(residual, axis=1)
        scale = max(1e-4, 1.5 * float(np.median(distance)))
        root = 1.0 / np.sqrt(1.0 + (distance / scale) ** 2)[:, None]
        shared = np.concatenate([-_skew(moved - T[:3, 3]), np.tile(np.eye(3), (len(p), 1, 1))], axis=2)
        own = -turn if on_markers else R @ turn
        normal, gradient = np.zeros((count, count)), np.zeros(count)
        for k in range(len(offsets)):
            mine = marker == k
            rows = np.concatenate([shared[mine], own[mine]], axis=2) * root[mine, :, None]
            rows, place = rows.reshape(-1, 9), [*range(6), *range(6 + 3 * k, 9 + 3 * k)]
            normal[np.ix_(place, place)] += rows.T @ rows
            gradient[place] += rows.T @ (residual[mine] * root[mine]).ravel()
        prior = (scale / OFFSET_SIGMA_M) ** 2
        normal[np.arange(6, count), np.arange(6, count)] += prior
        gradient[6:] += prior * offsets.ravel()
        step = -np.linalg.solve(normal, gradient)
        turned = Rotation.from_rotvec(step[:3]).as_matrix()
        T = make_transform(turned @ R, T[:3, 3] + step[3:6])
        offsets += step[6:].reshape(-1, 3)
        if np.abs(step).max() < 1e-7:
            break
    return T, offsets


def _skew(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices of the cross product with each vector, shape (count, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)

"""Rigid transforms and rotations for several parts of the engine."""

import math

import numpy as np
from numpy.typing import NDArray


def transform_points(T: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points, shape (..., 3), moved by the 4x4 rigid transform `T`."""
    return points @ T[:3, :3].T + T[:3, 3]


def make_transform(rotation: NDArray[np.float64], translation: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the 4x4 transform of a 3x3 rotation and a translation [m]."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = translation
    return T


def invert_transform(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a 4x4 rigid transform."""
    return make_transform(T[:3, :3].T, -T[:3, :3].T @ T[:3, 3])


def is_rigid(T: NDArray[np.float64], tolerance: float = 1e-3) -> bool:
    """Whether `T` is a finite 4x4 rigid transform with det(R) = +1."""
    return bool(
        T.shape == (4, 4)
        and np.isfinite(T).all()
        and np.abs(T[3] - [0, 0, 0, 1]).max() < tolerance
        and np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max() < tolerance
        and np.linalg.det(T[:3, :3]) > 0
    )


def fit_rigid(
    source: NDArray[np.float64], target: NDArray[np.float64], weights: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return the 4x4 rigid transform from `source` to `target` with the least weighted squared error.

    Args:
        source: points [m], shape (point_count, 3), finite.
        target: corresponding points, same shape.
        weights: not negative, shape (point_count,); equal where None.

    Source: Arun, Huang, Blostein, "Least-squares fitting of two 3-D point sets", PAMI 1987, with the
    reflection guard of Umeyama, PAMI 1991.
    """
    w = np.ones(len(source)) if weights is None else weights
    w = w / w.sum()
    source_mean, target_mean = w @ source, w @ target
    covariance = (target - target_mean).T @ ((source - source_mean) * w[:, None])
    u, _, vt = np.linalg.svd(covariance)
    d = np.sign(np.linalg.det(u @ vt))
    rotation = u @ np.diag([1.0, 1.0, d]) @ vt
    return make_transform(rotation, target_mean - rotation @ source_mean)


def _quaternion_rows() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The elements of 4 q q^T as linear functions of a rotation matrix: factors, shape (9, 16), constants, shape
    (16,)."""
    plus_minus = {  # row, column of 4 q q^T: (sign, row, column of the matrix), ...
        (0, 0): ((1, 0, 0), (1, 1, 1), (1, 2, 2)), (1, 1): ((1, 0, 0), (-1, 1, 1), (-1, 2, 2)),
        (2, 2): ((-1, 0, 0), (1, 1, 1), (-1, 2, 2)), (3, 3): ((-1, 0, 0), (-1, 1, 1), (1, 2, 2)),
        (0, 1): ((1, 2, 1), (-1, 1, 2)), (0, 2): ((1, 0, 2), (-1, 2, 0)), (0, 3): ((1, 1, 0), (-1, 0, 1)),
        (1, 2): ((1, 0, 1), (1, 1, 0)), (1, 3): ((1, 0, 2), (1, 2, 0)), (2, 3): ((1, 1, 2), (1, 2, 1)),
    }  # fmt: skip
    factors = np.zeros((3, 3, 4, 4))
    for (row, column), terms in plus_minus.items():
        for sign, i, j in terms:
            factors[i, j, row, column] = factors[i, j, column, row] = sign
    return factors.reshape(9, 16), np.eye(4).ravel()


_ROW_FACTORS, _ROW_CONSTANTS = _quaternion_rows()


def quaternions(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return wxyz quaternions, shape (..., 4), w >= 0, of rotation matrices, shape (..., 3, 3).

    The rows of 4 q q^T are sums of the matrix's elements; the longest is normalised (Shepperd, "Quaternion from
    rotation matrix", 1978). SciPy takes five times as long for the joints of one frame.
    """
    rows = matrices.reshape(-1, 9) @ _ROW_FACTORS + _ROW_CONSTANTS
    longest = rows[:, ::5].argmax(axis=1)
    q = rows.reshape(-1, 4, 4)[np.arange(len(rows)), longest]
    q *= (np.where(q[:, 0] < 0, -1.0, 1.0) / np.sqrt(np.vecdot(q, q)))[:, None]
    return q.reshape(*matrices.shape[:-2], 4)


def rotation_xyz(x: float, y: float, z: float) -> NDArray[np.float64]:
    """Return the 3x3 rotation of three successive hinges, R(x axis, x) R(y axis, y) R(z axis, z); angles in rad."""
    cx, sx, cy, sy, cz, sz = math.cos(x), math.sin(x), math.cos(y), math.sin(y), math.cos(z), math.sin(z)
    return np.array(
        [
            [cy * cz, -cy * sz, sy],
            [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy],
            [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
        ]
    )


def angles_xyz(rotation: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the angles [rad] of `rotation_xyz`; the second within a quarter turn."""
    (r00, r01, r02), (_, _, r12), (_, _, r22) = rotation.tolist()
    return math.atan2(-r12, r22), math.asin(max(-1.0, min(1.0, r02))), math.atan2(-r01, r00)


def matrices(quaternions_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotation matrices, shape (..., 3, 3), of wxyz quaternions, shape (..., 4)."""
    from scipy.spatial.transform import Rotation  # slow to load, and a camera needs none

    m = Rotation.from_quat(quaternions_wxyz.reshape(-1, 4), scalar_first=True).as_matrix()
    return m.reshape(*quaternions_wxyz.shape[:-1], 3, 3)


_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]


def cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a x b, shapes (..., 3). `np.cross` gives the same and takes five times as long for one frame."""
    return a[..., _NEXT] * b[..., _AFTER] - a[..., _AFTER] * b[..., _NEXT]


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors of length 1, shape (..., 3) or (..., 2); a zero vector stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def rotation_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the smallest rotation, 3x3, that turns direction `a` to direction `b` (swing without twist).

    A zero vector gives the identity.
    """
    a_length, b_length = math.sqrt(a @ a), math.sqrt(b @ b)
    if not (a_length > 0 and b_length > 0):
        return np.eye(3)
    a, b = a / a_length, b / b_length
    v, one_plus_cosine = cross(a, b), 0.5 * float((a + b) @ (a + b))
    if one_plus_cosine < 1e-9:  # opposite: a half turn about any axis perpendicular to a
        least: NDArray[np.float64] = np.eye(3)[np.argmin(np.abs(a))]
        axis = cross(a, least)
        axis /= np.linalg.norm(axis)
        return 2 * np.outer(axis, axis) - np.eye(3)
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + k + k @ k / one_plus_cosine


def nearest_on_segments(
    a0: NDArray[np.float64], a1: NDArray[np.float64], b0: NDArray[np.float64], b1: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the nearest points of the segments a0 a1 and b0 b1.

    Args:
        a0, a1, b0, b1: ends [m], shape (..., 3).

    Returns:
        The position of the nearest point as a share of a0 a1 and of b0 b1, each of shape (...), and the vector from
        the point on b to the point on a [m], shape (..., 3). Parallel segments give one of the nearest pairs.

    Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.9.
    """
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, uv, vv, uw, vw = ((x * y).sum(axis=-1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    uu, vv = np.maximum(uu, 1e-18), np.maximum(vv, 1e-18)
    across = uu * vv - uv**2
    with np.errstate(invalid="ignore", divide="ignore"):
        s = np.where(across > 1e-12 * uu * vv, np.clip((uv * vw - vv * uw) / across, 0.0, 1.0), 0.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return s, t, w + s[..., None] * u - t[..., None] * v

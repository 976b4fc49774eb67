"""Unit quaternions in bulk: wxyz in the last axis, any shapes that broadcast."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def multiply(a: Array, b: Array) -> Array:
    """Return the rotations `b` followed by `a`."""
    aw, ax, ay, az = (a[..., k] for k in range(4))
    bw, bx, by, bz = (b[..., k] for k in range(4))
    out = np.empty((*np.broadcast_shapes(a.shape[:-1], b.shape[:-1]), 4))
    out[..., 0] = aw * bw - (ax * bx + ay * by + az * bz)
    out[..., 1] = aw * bx + bw * ax + (ay * bz - az * by)
    out[..., 2] = aw * by + bw * ay + (az * bx - ax * bz)
    out[..., 3] = aw * bz + bw * az + (ax * by - ay * bx)
    return out


def inverse(q: Array) -> Array:
    """Return the inverse rotations."""
    return q * [1.0, -1.0, -1.0, -1.0]


def rotate(q: Array, v: Array) -> Array:
    """Return vectors, shape (..., 3), rotated by quaternions, shape (..., 4)."""
    w, x, y, z = (q[..., k] for k in range(4))
    vx, vy, vz = (v[..., k] for k in range(3))
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    out = np.empty((*np.broadcast_shapes(q.shape[:-1], v.shape[:-1]), 3))
    out[..., 0] = vx + w * tx + y * tz - z * ty
    out[..., 1] = vy + w * ty + z * tx - x * tz
    out[..., 2] = vz + w * tz + x * ty - y * tx
    return out


def normalized(q: Array) -> Array:
    """Return quaternions of length 1."""
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def blended(a: Array, b: Array, share: float | Array) -> Array:
    """Return rotations between two, shape (..., 4): a at share 0, b at share 1, on the shorter way. The interpolation
    is linear and normalised, so the speed is not quite even."""
    sign = np.where((a * b).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return normalized((1.0 - share) * sign * a + share * b)


def continuous_signs(q: Array) -> Array:
    """Return quaternions, shape (frame_count, ..., 4), with signs chosen so that each is nearest to the one
    before."""
    dots = (q[1:] * q[:-1]).sum(axis=-1)
    out = q.copy()
    out[1:] *= np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)[..., None]
    return out

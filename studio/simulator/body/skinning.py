"""Skinning: the skin's movement with its bones."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array32 = NDArray[np.float32]


@compiled
def skin(
    vertices: Array32,
    bones: NDArray[np.int32],
    weights: Array32,
    quaternions: NDArray[np.float64],
    anchors: NDArray[np.float64],
    places: NDArray[np.float64],
) -> Array32:
    """Return the vertices moved by their bones [m], shape (V, 3).

    Args:
        vertices: in the T-pose [m], shape (V, 3).
        bones, weights: of every vertex, shape (V, 4).
        quaternions: rotation of every bone from the T-pose, wxyz, shape (B, 4).
        anchors, places: each bone's centre of rotation in the T-pose, and now [m], shape (B, 3).

    Source: Kavan et al. 2007, "Skinning with dual quaternions".
    """
    dual = _dual_quaternions(quaternions, anchors, places)
    out = np.empty_like(vertices)
    d = np.empty(8)
    for v in range(len(vertices)):
        first = bones[v, 0]
        d[:] = 0.0
        for k in range(4):
            share = weights[v, k]
            if share <= 0:
                continue
            b = bones[v, k]
            dot = 0.0
            for i in range(4):
                dot += dual[b, i] * dual[first, i]
            if dot < 0:
                share = -share
            for i in range(8):
                d[i] += share * dual[b, i]
        length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + d[3] * d[3]) ** 0.5
        w, x, y, z = d[0] / length, d[1] / length, d[2] / length, d[3] / length
        e, f, g, h = d[4] / length, d[5] / length, d[6] / length, d[7] / length
        tx = 2 * (-e * x + f * w - g * z + h * y)
        ty = 2 * (-e * y + f * z + g * w - h * x)
        tz = 2 * (-e * z - f * y + g * x + h * w)
        px, py, pz = vertices[v]
        out[v, 0] = (1 - 2 * (y * y + z * z)) * px + 2 * (x * y - w * z) * py + 2 * (x * z + w * y) * pz + tx
        out[v, 1] = 2 * (x * y + w * z) * px + (1 - 2 * (x * x + z * z)) * py + 2 * (y * z - w * x) * pz + ty
        out[v, 2] = 2 * (x * z - w * y) * px + 2 * (y * z + w * x) * py + (1 - 2 * (x * x + y * y)) * pz + tz
    return out


@compiled
def _dual_quaternions(
    quaternions: NDArray[np.float64], anchors: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Every bone's motion as a dual quaternion: rotation, then half of translation times rotation, shape (B, 8)."""
    count = len(quaternions)
    dual = np.empty((count, 8))
    for b in range(count):
        w, x, y, z = quaternions[b]
        ax, ay, az = anchors[b]
        tx = places[b, 0] - (
            (1 - 2 * (y * y + z * z)) * ax + 2 * (x * y - w * z) * ay + 2 * (x * z + w * y) * az
        )
        ty = places[b, 1] - (
            2 * (x * y + w * z) * ax + (1 - 2 * (x * x + z * z)) * ay + 2 * (y * z - w * x) * az
        )
        tz = places[b, 2] - (
            2 * (x * z - w * y) * ax + 2 * (y * z + w * x) * ay + (1 - 2 * (x * x + y * y)) * az
        )
        dual[b, 0], dual[b, 1], dual[b, 2], dual[b, 3] = w, x, y, z
        dual[b, 4] = -0.5 * (tx * x + ty * y + tz * z)
        dual[b, 5] = 0.5 * (tx * w + ty * z - tz * y)
        dual[b, 6] = 0.5 * (-tx * z + ty * w + tz * x)
        dual[b, 7] = 0.5 * (tx * y - ty * x + tz * w)
    return dual

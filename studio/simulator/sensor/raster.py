"""Rasterisation of triangles to a depth image."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.cameras.depth import DepthCamera

Array32 = NDArray[np.float32]
_NEAR_M = 0.05


class Rasteriser:
    """Draws meshes in one camera's image.

    Args:
        camera: its intrinsics.
    """

    def __init__(self, camera: DepthCamera) -> None:
        corner = np.linalg.norm(camera.rays.reshape(-1, 2), axis=1).max()
        self._lens = np.zeros(13)
        self._lens[:4] = camera.fx, camera.fy, camera.cx, camera.cy
        self._lens[4 : 4 + len(camera.distortion)] = camera.distortion
        self._lens[12] = (1.1 * corner) ** 2  # the lens model is valid only within the image

    def draw(
        self,
        vertices: Array32,
        triangles: NDArray[np.int32],
        T_camera_stage: NDArray[np.float64],
        depth_m: Array32,
        index: NDArray[np.int32],
    ) -> None:
        """Draw triangles that face the camera into a depth image, where they are nearer than its content.

        Args:
            vertices: in the stage frame [m], shape (V, 3).
            triangles: counter-clockwise seen from outside, shape (T, 3); back faces are skipped.
            T_camera_stage: takes stage points to the camera, shape (4, 4).
            depth_m: z per pixel, inf = nothing yet, shape (H, W); updated.
            index: index of the triangle in each pixel, shape (H, W); updated.
        """
        _draw(vertices, triangles, T_camera_stage, self._lens, depth_m, index)


@compiled
def _draw(
    vertices: Array32,
    triangles: NDArray[np.int32],
    T: NDArray[np.float64],
    lens: NDArray[np.float64],
    depth: Array32,
    index: NDArray[np.int32],
) -> None:
    """See `Rasteriser.draw`; inverse depth is linear in the image."""
    height, width = depth.shape
    fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6, limit = lens
    distorted = k1 != 0 or k2 != 0 or p1 != 0 or p2 != 0 or k3 != 0 or k4 != 0
    seen = np.empty((len(vertices), 3), np.float32)
    for v in range(len(vertices)):
        px, py, pz = vertices[v]
        x = T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3]
        y = T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3]
        z = T[2, 0] * px + T[2, 1] * py + T[2, 2] * pz + T[2, 3]
        if z < _NEAR_M:
            seen[v, 2] = -1
            continue
        x, y = x / z, y / z
        r2 = x * x + y * y
        if r2 > limit:
            seen[v, 2] = -1
            continue
        if distorted:
            factor = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
            x, y = (
                x * factor + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * factor + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            )
        seen[v, 0], seen[v, 1], seen[v, 2] = fx * x + cx, fy * y + cy, 1 / z
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        wa, wb, wc = seen[a, 2], seen[b, 2], seen[c, 2]
        if wa < 0 or wb < 0 or wc < 0:
            continue
        ax, ay, bx, by, qx, qy = seen[a, 0], seen[a, 1], seen[b, 0], seen[b, 1], seen[c, 0], seen[c, 1]
        area = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax)
        if area >= 0:  # y points down in the image, so a front face is clockwise there
            continue
        left, right = int(np.ceil(min(ax, bx, qx))), int(np.floor(max(ax, bx, qx)))
        top, bottom = int(np.ceil(min(ay, by, qy))), int(np.floor(max(ay, by, qy)))
        for row in range(max(top, 0), min(bottom, height - 1) + 1):
            for column in range(max(left, 0), min(right, width - 1) + 1):
                ea = ((bx - column) * (qy - row) - (by - row) * (qx - column)) / area
                eb = ((qx - column) * (ay - row) - (qy - row) * (ax - column)) / area
                ec = 1 - ea - eb
                if ea >= 0 and eb >= 0 and ec >= 0:
                    z = 1 / (ea * wa + eb * wb + ec * wc)
                    if z < depth[row, column]:
                        depth[row, column] = z
                        index[row, column] = t

"""What depth cameras see at an instant, without the room and the performers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX, PARENT_OF_CANONICAL

Array = NDArray[np.float64]

FLOOR_M = 0.04
_BEHIND_SHARE = 0.9
_HAND_M = 0.08
_HAND_WEIGHT = 0.25
_RADII_M = {
    "spine": 0.19, "chest": 0.20, "neck": 0.16, "head": 0.15, "shoulder": 0.14, "elbow": 0.085, "wrist": 0.075,
    "hip": 0.17, "knee": 0.12, "ankle": 0.10, "toe": 0.10,
}  # fmt: skip
"""Radius of flesh and clothes around the bone that ends at a joint, including the error of a solve."""

_BONES = [(INDEX[child], INDEX[parent], _RADII_M[child.split("_")[-1]])
          for child, parent in PARENT_OF_CANONICAL.items() if not child.endswith("hand")]  # fmt: skip
_TOP_M = 0.10
"""Distance of the top of the head beyond its joint."""


@dataclass(frozen=True)
class SeenImage:
    """An image of one camera, without room and performers.

    Attributes:
        camera: its lens. T_camera_stage: takes stage points to it.
        z_m: of every pixel, 0 = no reading, shape (H, W).
        pixels: row and column of pixels of neither room nor performer, shape (n, 2).
        points_m: the same on the stage, shape (n, 3).
        weights: of these, smaller near a hand, shape (n,).
        after_s: delay of the image after the instant.
    """

    camera: DepthCamera
    T_camera_stage: Array
    z_m: NDArray[np.float32]
    pixels: NDArray[np.int64]
    points_m: Array
    weights: Array
    after_s: float

    @property
    def eye_m(self) -> Array:
        """The camera's position on the stage."""
        return -self.T_camera_stage[:3, :3].T @ self.T_camera_stage[:3, 3]


class PropCamera:
    """A camera on the stage, and the room as it sees it.

    Args:
        camera: its lens.
        T_stage_camera: its pose.
        images: evenly spread over the take [mm]. The room is what is there most of the time and farthest away.
    """

    def __init__(
        self, camera: DepthCamera, T_stage_camera: Array, images: Sequence[NDArray[np.uint16]]
    ) -> None:
        self._camera, self._T_stage_camera = camera, T_stage_camera
        self._T_camera_stage = invert_transform(T_stage_camera)
        stack = np.stack(images).astype(np.float32) * np.float32(0.001)
        far = np.sort(np.where(stack > 0, stack, np.inf), axis=0)
        seldom = (stack > 0).sum(axis=0) < 0.25 * len(stack)
        readings = np.isfinite(far).sum(axis=0)
        chosen = np.clip(np.ceil(_BEHIND_SHARE * readings).astype(int) - 1, 0, None)
        behind = np.take_along_axis(far, chosen[None], axis=0)[0]
        self._behind = np.where(seldom, np.inf, behind)

    def see(self, depth_mm: NDArray[np.uint16], after_s: float, people: Sequence[Array]) -> SeenImage:
        """Return an image without the room and `people`, given as canonical joints on the stage [m], (21, 3) each."""
        z = depth_mm.astype(np.float32) * np.float32(0.001)
        front = (z > 0) & (z < self._behind - (0.05 + 0.006 * z * z)) & _confirmed(z)
        pixels = np.argwhere(front)
        rays = self._camera.rays[front].astype(np.float64)
        depth = z[front].astype(np.float64)
        points = transform_points(self._T_stage_camera, np.column_stack([rays * depth[:, None], depth]))
        kept = points[:, 2] > FLOOR_M
        weights = np.ones(len(points))
        for joints in people:
            kept &= ~_on_body(points, joints)
            for hand in ("left_hand", "right_hand"):
                near = np.linalg.norm(points - joints[INDEX[hand]], axis=1) < _HAND_M
                weights[near] = _HAND_WEIGHT
        return SeenImage(
            self._camera, self._T_camera_stage, z, pixels[kept], points[kept], weights[kept], after_s
        )


def _confirmed(z: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether two of a pixel's eight neighbours have about its depth; if not, it is a mixture of near and far."""
    tall, wide = z.shape
    padded = np.zeros((tall + 2, wide + 2), np.float32)
    padded[1:-1, 1:-1] = z
    near = 0.03 + 0.004 * z * z
    count = np.zeros(z.shape, np.int8)
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                count += np.abs(padded[i : i + tall, j : j + wide] - z) < near
    return count >= 2


def _on_body(points: Array, joints: Array) -> NDArray[np.bool_]:
    found = np.zeros(len(points), bool)
    top = joints[INDEX["head"]] + _TOP_M * (joints[INDEX["head"]] - joints[INDEX["neck"]]) / max(
        float(np.linalg.norm(joints[INDEX["head"]] - joints[INDEX["neck"]])), 1e-6
    )
    bones = [
        *((joints[a], joints[b], r) for a, b, r in _BONES),
        (top, joints[INDEX["head"]], _RADII_M["head"]),
    ]
    for a, b, radius in bones:
        rest = ~found
        if not (np.isfinite(a).all() and np.isfinite(b).all()):
            continue
        way, from_a = b - a, points[rest] - a
        share = np.clip(from_a @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        found[rest] = ((from_a - share[:, None] * way) ** 2).sum(axis=1) < radius**2
    return found

"""Head orientation from the head's part of a depth image.

A small network looks at the head as the camera sees it, cut out at its top and middle, and tells where the face and
the crown point. Both are means over what the head could be, so their length says how sure they are: a face that
cannot be told from the back of the head has a short arrow. Weights come from simulated heads;
`python -m studio.camera.simulator.head_training` makes them again.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.depth import DepthCamera, project
from studio.engine.geometry import quaternions
from studio.engine.joints import INDEX
from studio.engine.network import Network

WEIGHTS = Path(__file__).with_name("head.npz")

Array = NDArray[np.float64]

SIDE = 18
"""Samples along each side of the window."""

_HALF_M = 0.16
_BAND_M = 0.22
_ABOVE_JOINT_M = 0.09
_LEAST_FILLED = 20
_LEAST_LENGTH = 0.8
_PITCH_DEG = 9.0
"""How far too low the heads of tuning performers are found to face, seen with the tracker; it is taken back."""

_FOLLOW_S = 0.05
_FORGET_S = 0.3
_R_LIFT = np.array(
    [
        [1.0, 0.0, 0.0],
        [0.0, np.cos(np.radians(_PITCH_DEG)), np.sin(np.radians(_PITCH_DEG))],
        [0.0, -np.sin(np.radians(_PITCH_DEG)), np.cos(np.radians(_PITCH_DEG))],
    ]
)


@dataclass(frozen=True)
class HeadSeen:
    """A measured head orientation.

    Attributes:
        wxyz: the head's turn in the camera frame from the T-pose, in which it faces -y with z up.
        confidence: 0..1.
    """

    wxyz: tuple[float, float, float, float]
    confidence: float


def head_window(camera: DepthCamera, depth_mm: NDArray[np.uint16], head: Array) -> Array | None:
    """Return the network's inputs for a head, or None where the image shows nothing there.

    The window hangs from the top of the head and is centred on its middle, so that a joint that is a few centimetres
    off does no harm. Inputs are the share filled and the nearness of each sample, then the pixel size and distance.

    Args:
        camera: of the image.
        depth_mm: the image, shape (H, W).
        head: the joint of the head, at the skull's base, in the camera frame [m], shape (3,).
    """
    if not np.isfinite(head).all() or head[2] < 0.3:
        return None
    middle = head - np.array([0.0, _ABOVE_JOINT_M, 0.0])
    place = project(camera, middle)
    step_m = 2.0 * _HALF_M / (SIDE - 1)
    pixels = np.array([camera.fx, camera.fy]) / middle[2]
    steps = (np.arange(SIDE) - 0.5 * (SIDE - 1)) * step_m
    grid = np.stack(np.broadcast_arrays(steps[None, :], steps[:, None]), axis=-1)
    filled, nearer, distance_m = _sample(depth_mm, place + grid * pixels, middle[2])
    if filled.sum() < _LEAST_FILLED:
        return None
    pixels = np.array([camera.fx, camera.fy]) / distance_m
    place = place + _to_top_and_middle(filled) * step_m * pixels
    filled, nearer, distance_m = _sample(depth_mm, place + grid * pixels, distance_m)
    if filled.sum() < _LEAST_FILLED:
        return None
    return np.concatenate([filled.ravel(), 12.0 * nearer.ravel(), [20.0 / pixels[0] * 1e1, distance_m / 3.0]])


def _sample(depth_mm: NDArray[np.uint16], grid: Array, near_m: float) -> tuple[Array, Array, float]:
    """Return share filled, how much nearer than the head's distance [m], both (SIDE, SIDE), and that distance."""
    first = np.floor(grid).astype(int)
    part = grid - first
    filled, depth = np.zeros(grid.shape[:2]), np.zeros(grid.shape[:2])
    for right in (0, 1):
        for down in (0, 1):
            columns, rows = first[..., 0] + right, first[..., 1] + down
            inside = (columns >= 0) & (columns < depth_mm.shape[1]) & (rows >= 0) & (rows < depth_mm.shape[0])
            z = depth_mm[np.where(inside, rows, 0), np.where(inside, columns, 0)] * 1e-3
            weight = np.abs(1 - right - part[..., 0]) * np.abs(1 - down - part[..., 1])
            weight = weight * (inside & (np.abs(z - near_m) < _BAND_M))
            filled += weight
            depth += weight * z
    seen = filled > 0.25
    depth = np.where(seen, depth / np.maximum(filled, 1e-9), 0.0)
    distance_m = float(np.median(depth[seen])) if seen.any() else near_m
    return np.where(seen, filled, 0.0), np.where(seen, distance_m - depth, 0.0), distance_m


def _to_top_and_middle(filled: Array) -> Array:
    """How far to move the window, in samples right and down, so that the head hangs from its third row."""
    rows = filled.sum(axis=1)
    top = int(np.argmax(rows > 1.5))
    head = filled[top : top + SIDE // 2 + 1].sum(axis=0)
    middle = float(head @ np.arange(SIDE) / max(head.sum(), 1e-9))
    return np.array([middle - 0.5 * (SIDE - 1), top - 2.0])


@cache
def head_network() -> Network:
    """Return the network of `head.npz`: three outputs for where the face points, three for the crown."""
    return Network.load(WEIGHTS)


class HeadTracker:
    """Measures the performer's head orientation in one camera's images.

    Args:
        camera: of the images.
        network: the built-in one where None.
    """

    def __init__(self, camera: DepthCamera, network: Network | None = None) -> None:
        self._camera = camera
        self._network = head_network() if network is None else network
        self._arrows: Array | None = None
        self._time_ns = 0

    def update(
        self,
        depth_mm: NDArray[np.uint16],
        positions: NDArray[np.float64],
        confidence: NDArray[np.float64],
        time_ns: int,
    ) -> HeadSeen | None:
        """Return the head's orientation, or None where it cannot be told.

        Args:
            depth_mm: the image, shape (H, W).
            positions: canonical joints in the camera frame [m], shape (21, 3).
            confidence: shape (21,).
            time_ns: of the image; images come in order of time.
        """
        head = positions[INDEX["head"]]
        inputs = head_window(self._camera, depth_mm, head) if confidence[INDEX["head"]] > 0 else None
        dt = (time_ns - self._time_ns) * 1e-9
        if inputs is None:
            self._arrows = self._arrows if dt < _FORGET_S else None
            return None
        arrows = self._network(inputs[None])[0].reshape(2, 3) @ _R_LIFT.T @ along_ray(head).T
        share = 1.0 if self._arrows is None or dt > _FORGET_S else 1.0 - float(np.exp(-dt / _FOLLOW_S))
        self._arrows = arrows if self._arrows is None else self._arrows + share * (arrows - self._arrows)
        self._time_ns = time_ns
        return oriented(*self._arrows)


def along_ray(place: Array) -> Array:
    """Return the smallest turn of the camera frame that makes its z axis point to a place, shape (3, 3)."""
    x, y, z = place / np.linalg.norm(place)
    return np.array(
        [[1 - x * x / (1 + z), -x * y / (1 + z), x], [-x * y / (1 + z), 1 - y * y / (1 + z), y], [-x, -y, z]]
    )


def oriented(face: Array, crown: Array) -> HeadSeen | None:
    """Return the orientation with this face and crown, shapes (3,); None where they are too short to tell."""
    sure = min(float(np.linalg.norm(face)), float(np.linalg.norm(crown)), 1.0)
    back = -face / max(float(np.linalg.norm(face)), 1e-9)
    up = crown - (crown @ back) * back
    if sure < _LEAST_LENGTH or np.linalg.norm(up) < 0.1:
        return None
    up = up / np.linalg.norm(up)
    w, x, y, z = quaternions(np.stack([np.cross(back, up), back, up], axis=1)).tolist()
    return HeadSeen((w, x, y, z), sure)

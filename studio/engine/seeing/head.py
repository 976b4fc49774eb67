"""Head orientation from the head's part of a depth image.

Small convolutional networks take a window of the image, aligned with the head's top and middle. They return the
directions of the face and of the crown. Both are means over the possible heads, so their length is a confidence:
a face that looks like the back of the head gives a short vector. The networks are trained on simulated heads;
`python -m studio.simulator.training.head_training` recreates them.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from studio.engine.base.geometry import quaternions
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX
from studio.engine.seeing.images.convolution import Committee
from studio.engine.seeing.images.depth_window import sampled

WEIGHTS = Path(__file__).with_name("head.npz")

Array = NDArray[np.float64]

SIDE = 32
"""Samples along each side of the window."""

CHANNELS, ABOUT = 3, 2
"""Channels of a sample, and numbers about the whole window; see `HeadWindow`."""

_STEP_M = 0.0095
_PLACES_M = (np.arange(SIDE) - 0.5 * (SIDE - 1)) * _STEP_M
_GRID_M = np.stack([*np.meshgrid(_PLACES_M, _PLACES_M), np.zeros((SIDE, SIDE))], axis=-1)
_BAND_M = 0.18
_ABOVE_JOINT_M = 0.09
_NEARER_M = 0.05
_RELIEF, _RELIEF_M, _MOST_RELIEF = 7, 0.01, 2.0
_TOP_ROW = 3
_HEAD_ROWS = 18
_TOP_FILLED = 3.0
_LEAST_FILLED, _MOST_FILLED = 70.0, 870.0
"""Accepted range of filled samples."""

_LEAST_LENGTH = 0.8
_FOLLOW_S = 0.05
_FORGET_S = 0.3


@dataclass(frozen=True)
class HeadSeen:
    """A measured head orientation.

    Attributes:
        wxyz: the head's rotation in the camera frame from the T-pose, in which it faces -y with z up.
        confidence: 0..1.
    """

    wxyz: tuple[float, float, float, float]
    confidence: float


@dataclass(frozen=True)
class HeadWindow:
    """Samples around a head, on a plane perpendicular to the ray to it; the first axis runs down, the second right.

    Attributes:
        samples: shape (SIDE, SIDE, CHANNELS): the share at the head's depth, its distance in front of the
            head along the ray (1 = 5 cm), and its distance in front of its surroundings within 7 samples
            (1 = 1 cm); 0 where empty.
        about: shape (ABOUT,): the size of a pixel and the distance, scaled.
        R_camera_window: the plane's axes right, down and along the ray, shape (3, 3).
    """

    samples: NDArray[np.float32]
    about: NDArray[np.float32]
    R_camera_window: Array


def head_window(camera: DepthCamera, depth_mm: NDArray[np.uint16], head: Array) -> HeadWindow | None:
    """Return the window around a head, or None if the image shows nothing there.

    The window is aligned with the top and the middle of the head, so that an error of a few centimetres in the joint
    has no effect.

    Args:
        camera: of the image.
        depth_mm: the image, shape (H, W).
        head: the joint of the head, at the skull's base, in the camera frame [m], shape (3,).
    """
    if not np.isfinite(head).all() or head[2] < 0.3:
        return None
    place = head - np.array([0.0, _ABOVE_JOINT_M, 0.0])
    R_camera_window = along_ray(place)
    filled, nearer_m = _on_plane(camera, depth_mm, place, R_camera_window)
    if filled.sum() < _LEAST_FILLED:
        return None
    rows, shift_m = _rows_and_shift_m(filled)
    deeper_m = -float(np.median(nearer_m[rows][filled[rows] > 0]))
    place = place + R_camera_window @ [*shift_m, deeper_m]
    R_camera_window = along_ray(place)
    filled, nearer_m = _on_plane(camera, depth_mm, place, R_camera_window)
    if not _LEAST_FILLED <= filled.sum() <= _MOST_FILLED:
        return None
    about_m = uniform_filter(nearer_m * filled, _RELIEF) / np.maximum(uniform_filter(filled, _RELIEF), 1e-6)
    relief = np.clip((nearer_m - about_m) / _RELIEF_M, -_MOST_RELIEF, _MOST_RELIEF)
    samples = np.stack([filled, nearer_m / _NEARER_M * filled, relief * filled], axis=-1)
    distance_m = float(np.linalg.norm(place))
    about = np.array([100.0 * distance_m / camera.fx, distance_m / 3.0])
    return HeadWindow(samples.astype(np.float32), about.astype(np.float32), R_camera_window)


def _on_plane(
    camera: DepthCamera, depth_mm: NDArray[np.uint16], place: Array, R_camera_window: Array
) -> tuple[Array, Array]:
    """Return the filled share of a plane's samples, and their distance in front of the plane along its ray [m]."""
    grid = place + _GRID_M @ R_camera_window.T
    filled, nearer_m, _ = sampled(depth_mm, camera.pixels_of(grid), grid[..., 2], _BAND_M)
    return filled, nearer_m * np.linalg.norm(place) / grid[..., 2]


def _rows_and_shift_m(filled: Array) -> tuple[slice, Array]:
    """Return the rows of the head, and the shift that aligns the window with them, right and down [m]."""
    top = int(np.argmax(filled.sum(axis=1) > _TOP_FILLED))
    rows = slice(top, top + _HEAD_ROWS)
    columns = filled[rows].sum(axis=0)
    return rows, np.array([columns @ _PLACES_M / columns.sum(), (top - _TOP_ROW) * _STEP_M])


@cache
def head_networks() -> Committee:
    """Return the networks of `head.npz`: three outputs for the direction of the face, three for the crown."""
    return Committee.load(WEIGHTS)


def head_arrows(
    camera: DepthCamera, depth_mm: NDArray[np.uint16], head: Array, networks: Committee | None = None
) -> Array | None:
    """Return the directions of face and crown in the camera frame, shape (2, 3), shorter = less certain; None if the
    image shows no head.

    Args:
        camera, depth_mm, head: see `head_window`.
        networks: the built-in ones where None.
    """
    window = head_window(camera, depth_mm, head)
    if window is None:
        return None
    told = (networks or head_networks())(window.samples[None], window.about[None])
    return told.reshape(2, 3).astype(np.float64) @ window.R_camera_window.T


class HeadTracker:
    """Measures the performer's head orientation in one camera's images.

    Args:
        camera: of the images.
        networks: the built-in ones where None.
    """

    def __init__(self, camera: DepthCamera, networks: Committee | None = None) -> None:
        self._camera = camera
        self._networks = networks
        self._arrows: Array | None = None
        self._time_ns = 0

    def update(
        self,
        depth_mm: NDArray[np.uint16],
        positions: NDArray[np.float64],
        confidence: NDArray[np.float64],
        time_ns: int,
    ) -> HeadSeen | None:
        """Return the head's orientation, or None where unknown.

        Args:
            depth_mm: the image, shape (H, W).
            positions: canonical joints in the camera frame [m], shape (21, 3).
            confidence: shape (21,).
            time_ns: of the image; images come in order of time.
        """
        head = positions[INDEX["head"]]
        arrows = None
        if confidence[INDEX["head"]] > 0:
            arrows = head_arrows(self._camera, depth_mm, head, self._networks)
        dt = (time_ns - self._time_ns) * 1e-9
        if arrows is None:
            self._arrows = self._arrows if dt < _FORGET_S else None
            return None
        share = 1.0 if self._arrows is None or dt > _FORGET_S else 1.0 - float(np.exp(-dt / _FOLLOW_S))
        self._arrows = arrows if self._arrows is None else self._arrows + share * (arrows - self._arrows)
        self._time_ns = time_ns
        return oriented(*self._arrows)


def along_ray(place: Array) -> Array:
    """Return the smallest rotation of the camera frame after which its z axis points to a place, shape (3, 3)."""
    x, y, z = place / np.linalg.norm(place)
    return np.array(
        [[1 - x * x / (1 + z), -x * y / (1 + z), x], [-x * y / (1 + z), 1 - y * y / (1 + z), y], [-x, -y, z]]
    )


def oriented(face: Array, crown: Array) -> HeadSeen | None:
    """Return the orientation with this face and crown, shapes (3,); None where they are too short."""
    sure = min(float(np.linalg.norm(face)), float(np.linalg.norm(crown)), 1.0)
    back = -face / max(float(np.linalg.norm(face)), 1e-9)
    up = crown - (crown @ back) * back
    if sure < _LEAST_LENGTH or np.linalg.norm(up) < 0.1:
        return None
    up = up / np.linalg.norm(up)
    w, x, y, z = quaternions(np.stack([np.cross(back, up), back, up], axis=1)).tolist()
    return HeadSeen((w, x, y, z), sure)

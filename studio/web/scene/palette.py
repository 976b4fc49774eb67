"""Colours of cameras, of the stage and of confidence, for the view and the page."""

import numpy as np
from numpy.typing import NDArray

CAMERA_COLOURS: tuple[tuple[int, int, int], ...] = (
    (232, 131, 58),
    (62, 140, 214),
    (196, 84, 160),
    (88, 168, 84),
    (214, 178, 46),
    (122, 108, 214),
    (70, 176, 172),
    (206, 88, 82),
)
"""Colours of cameras in order; they repeat when there are more cameras."""

STRANGER_RGB = (136, 142, 150)
BODY_RGB = (203, 208, 214)
JOINT_RGB = (82, 92, 106)
GHOST_RGB = (232, 160, 84)
GHOST_OPACITY = 0.38
FUSED_BONE_RGB = (58, 70, 88)
EFFECTOR_RGB = (208, 64, 120)
GAZE_RGB = (38, 132, 176)
_SURE_RGB = np.array([24.0, 142.0, 110.0])
_DOUBTFUL_RGB = np.array([222.0, 152.0, 52.0])
_LOST_RGB = np.array([206.0, 70.0, 70.0])


def camera_colours(names: list[str] | tuple[str, ...]) -> dict[str, tuple[int, int, int]]:
    """Return a colour per camera, RGB 0..255, in the order of the names."""
    return {name: CAMERA_COLOURS[i % len(CAMERA_COLOURS)] for i, name in enumerate(names)}


def as_hex(rgb: tuple[int, int, int]) -> str:
    """Return a colour as `#rrggbb`."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def confidence_colours(confidence: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return RGB colours, shape (N, 3): red if unknown, amber if doubtful, green if certain."""
    c = np.clip(confidence, 0.0, 1.0)[:, None]
    low = _LOST_RGB + (_DOUBTFUL_RGB - _LOST_RGB) * np.clip(c / 0.5, 0.0, 1.0)
    colours = np.where(
        c < 0.5, low, _DOUBTFUL_RGB + (_SURE_RGB - _DOUBTFUL_RGB) * np.clip(2.0 * c - 1.0, 0.0, 1.0)
    )
    return np.round(colours).astype(np.uint8)

"""The face as landmarks see it: eleven places on a rigid head, by which its orientation is found.

The order is that of the joint set `mediapipe`: nose, left eye from the nose outward, right eye likewise, ears, corners of
the mouth.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_SETS

NAMES = JOINT_SETS["mediapipe"][: JOINT_SETS["mediapipe"].index("left_shoulder")]
LANDMARKS = len(NAMES)

_PLACES = {
    "nose": (0.0, -0.090, 0.0),
    "eye_inner": (0.016, -0.064, 0.031),
    "eye": (0.029, -0.060, 0.031),
    "eye_outer": (0.041, -0.054, 0.030),
    "ear": (0.066, 0.0, 0.0),
    "mouth": (0.023, -0.080, -0.040),
}


def _part(name: str) -> tuple[str, float]:
    """A landmark's part of the face, and the side it is on: 1 = left, -1 = right."""
    for side, sign in (("left", 1.0), ("right", -1.0)):
        if side in name:
            return name.replace(side, "").strip("_"), sign
    return name, 1.0


def _places() -> NDArray[np.float64]:
    out = np.empty((LANDMARKS, 3))
    for k, name in enumerate(NAMES):
        part, sign = _part(name)
        out[k] = np.array(_PLACES[part]) * [sign, 1.0, 1.0]
    return out


PLACES_M: NDArray[np.float64] = _places()
"""Each landmark from the middle of the ears, in the T-pose's axes [m], shape (11, 3): the means of true faces (Farkas,
"Anthropometry of the head and face", 1994) and of BlazePose's, which are smaller. A follower finds the size."""

MIRROR: NDArray[np.int64] = np.array(
    [NAMES.index(name.replace("left", "?").replace("right", "left").replace("?", "right")) for name in NAMES]
)
"""`landmarks[MIRROR]` exchanges left and right."""

EARS = [NAMES.index("left_ear"), NAMES.index("right_ear")]

SURE = 0.5
"""A landmark that is less visible than this does not count."""


def seen_in(
    joint_set: str, pixels: NDArray[np.float64], visibility: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return the pixels of the face's landmarks, shape (11, 2), NaN = not seen; None where none is.

    Args:
        joint_set: whose landmarks they are; only those of `mediapipe` have a face.
        pixels: of its landmarks, shape (joint_count, 2); NaN = unseen.
        visibility: shape (joint_count,), 0..1.
    """
    if joint_set != "mediapipe":
        return None
    out = np.where(visibility[:LANDMARKS, None] >= SURE, pixels[:LANDMARKS], np.nan)
    return None if np.isnan(out).all() else out

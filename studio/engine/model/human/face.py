"""The face as landmarks: eleven places on a rigid head, from which its orientation is found.

The order is that of the joint set `mediapipe`: nose, left eye from the nose outward, right eye likewise, ears, mouth.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import JOINT_SETS

NAMES = JOINT_SETS["mediapipe"][: JOINT_SETS["mediapipe"].index("left_shoulder")]
LANDMARKS = len(NAMES)

# Heights are over the Frankfurt horizontal, from the ear's opening to the lower rim of the eye's socket: it is level
# in a head that looks straight ahead: a true pupil is 1.5 cm above it, the tip of the nose 2 and the mouth 5 below.
_PLACES = {
    "nose": (0.0, -0.096, -0.016),
    "eye_inner": (0.014, -0.072, 0.013),
    "eye": (0.027, -0.068, 0.013),
    "eye_outer": (0.038, -0.058, 0.012),
    "ear": (0.060, 0.0, 0.0),
    "mouth": (0.021, -0.075, -0.040),
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
"""Each landmark from the middle of the ears, in the T-pose's axes [m], shape (11, 3): four fifths of true faces
(Farkas, "Anthropometry of the head and face", 1994), as BlazePose's are smaller. A follower finds the size."""

MIRROR: NDArray[np.int64] = np.array(
    [NAMES.index(name.replace("left", "?").replace("right", "left").replace("?", "right")) for name in NAMES]
)
"""`landmarks[MIRROR]` exchanges left and right."""

EARS = [NAMES.index("left_ear"), NAMES.index("right_ear")]

SURE = 0.5
"""Lowest visibility of a landmark that counts."""


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

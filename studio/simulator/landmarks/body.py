"""The 33 landmarks of a pose network, computed from a body's canonical joints.

Face, fingers and heels are fixed in the axes of head, hands and feet. Sizes: Farkas, "Anthropometry of the head
and face", 1994, and NASA STD-3000, 1995.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import INDEX, JOINT_COUNT, JOINT_SETS, PARENTS
from studio.simulator.joints.bone_frames import bone_frames

NAMES = JOINT_SETS["mediapipe"]

# Landmark -> the canonical joint it is fixed to, and its place in that bone's T-pose axes (left, back, up) [m]. The
# ears and the lower rims of the eye sockets are level (the Frankfurt horizontal).
_ON_FACE = {
    "nose": (0.0, -0.115, -0.018),
    **{
        f"left_eye{part}": (x, -0.09, 0.018)
        for part, x in (("_inner", 0.017), ("", 0.032), ("_outer", 0.046))
    },
    "left_ear": (0.075, 0.0, 0.0),
    "mouth_left": (0.026, -0.1, -0.048),
}
_ON_LIMBS = {
    "shoulder": ("shoulder", (0.0, 0.0, 0.0)),
    "elbow": ("elbow", (0.0, 0.0, 0.0)),
    "wrist": ("wrist", (0.0, 0.0, 0.0)),
    "pinky": ("hand", (0.0, 0.03, 0.0)),
    "index": ("hand", (0.0, -0.03, 0.0)),
    "thumb": ("wrist", (0.05, -0.045, 0.0)),
    "hip": ("hip", (0.0, 0.0, 0.0)),
    "knee": ("knee", (0.0, 0.0, 0.0)),
    "ankle": ("ankle", (0.0, 0.0, 0.0)),
    "heel": ("ankle", (0.0, 0.05, -0.05)),
    "foot_index": ("toe", (0.0, 0.0, 0.0)),
}


def _fixed() -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Each landmark's canonical joint, and its place in that bone's axes, shapes (33,) and (33, 3)."""
    joints, places = np.zeros(len(NAMES), dtype=np.int64), np.zeros((len(NAMES), 3))
    for k, name in enumerate(NAMES):
        mirrored = name.replace("right", "left")
        if mirrored in _ON_FACE:
            joints[k], place = INDEX["head"], _ON_FACE[mirrored]
        else:
            side, part = name.split("_", 1)
            joint, place = _ON_LIMBS[part]
            joints[k] = INDEX[f"{side}_{joint}"]
        places[k] = np.array(place) * ([-1.0, 1.0, 1.0] if mirrored != name else 1.0)
    return joints, places


JOINT_OF, PLACES = _fixed()
"""The canonical joint that each landmark is fixed to, shape (33,), and its place in that bone's axes [m], (33, 3)."""


_VERTEX_M = 0.13
"""Height of the head above the ears."""


def stature_m(body_m: NDArray[np.float64]) -> float:
    """Return a performer's height to the top of the head [m] from the T-pose offsets, shape (21, 3)."""
    joint, height = INDEX["head"], _VERTEX_M
    while joint >= 0:
        height += float(body_m[joint, 2])
        joint = int(PARENTS[joint])
    return height


def landmarks_of(
    joints_m: NDArray[np.float64],
    body_m: NDArray[np.float64],
    anatomy_m: NDArray[np.float64],
    heads: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Return the landmarks, shape (F, 33, 3) [m].

    Args:
        joints_m: canonical joints, shape (F, 21, 3).
        body_m: T-pose offsets of the performer, shape (21, 3); see `CanonicalMotion`.
        anatomy_m: offset at which a network sees each landmark, in the bones' axes, shape (33, 3).
        heads: rotations of the head, shape (F, 3, 3); None = the head follows the chest.
    """
    assert joints_m.shape[1] == JOINT_COUNT
    frames = bone_frames(joints_m, body_m)
    if heads is not None:
        frames[:, INDEX["head"]] = heads
    frames = frames[:, JOINT_OF]
    return joints_m[:, JOINT_OF] + (frames * (PLACES + anatomy_m)[:, None, :]).sum(axis=-1)

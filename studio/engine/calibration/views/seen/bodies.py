"""Bones that keep their lengths, and the sum of the limbs' lengths for a performer's height."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.views.seen.view import COLUMNS, NUMBER
from studio.engine.model.human.anthropometry import anthropometric_positions

Array: TypeAlias = NDArray[np.float64]

USUAL_HEIGHT_M = 1.75

_ON_BOTH_SIDES = (
    ("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand"),
    ("hip", "knee"), ("knee", "ankle"), ("ankle", "toe"), ("shoulder", "hip"),
)  # fmt: skip
_ACROSS = ("shoulder", "hip")


def _bones() -> tuple[list[tuple[int, int]], list[int]]:
    """Return the joints at both ends of each bone, and the index of its length: left and right share one."""
    ends, lengths = [], []
    for k, (a, b) in enumerate(_ON_BOTH_SIDES):
        for side in ("left", "right"):
            ends.append((NUMBER[f"{side}_{a}"], NUMBER[f"{side}_{b}"]))
            lengths.append(k)
    for k, name in enumerate(_ACROSS):
        ends.append((NUMBER[f"left_{name}"], NUMBER[f"right_{name}"]))
        lengths.append(len(_ON_BOTH_SIDES) + k)
    for side in ("left", "right"):
        ends.append((NUMBER["head"], NUMBER[f"{side}_shoulder"]))
        lengths.append(len(_ON_BOTH_SIDES) + len(_ACROSS))
    return ends, lengths


_ENDS, _LENGTHS = _bones()
BONES: NDArray[np.int64] = np.array(_ENDS)
"""Indices among `view.JOINTS` of each bone's ends, shape (bone_count, 2)."""
LENGTH_OF: NDArray[np.int64] = np.array(_LENGTHS)
"""Index of each bone's length, shape (bone_count,)."""
LENGTH_COUNT = int(LENGTH_OF.max()) + 1
BONE_NAMES: tuple[str, ...] = (
    *(f"{a}_{b}" for a, b in _ON_BOTH_SIDES), "shoulder_shoulder", "hip_hip", "head_shoulder",
)  # fmt: skip
"""Name of each length: the joints at its ends."""
LIMBS: NDArray[np.int64] = np.array([0, 1, 3, 4, 6])
"""Lengths whose sum represents the height: upper arm, forearm, thigh, shank and trunk."""


def known_of(points: Array) -> NDArray[np.bool_]:
    """Return whether points, shape (..., 3), are finite."""
    return np.asarray(np.isfinite(points).all(axis=-1))


def lengths(positions: Array) -> Array:
    """Return the usual length of each bone [m], both sides together, shape (LENGTH_COUNT,).

    Args:
        positions: joints [m], shape (instant_count, 17, 3); NaN = unknown.
    """
    each = np.linalg.norm(positions[:, BONES[:, 0]] - positions[:, BONES[:, 1]], axis=2)
    out = np.zeros(LENGTH_COUNT)
    for k in range(LENGTH_COUNT):
        values = each[:, LENGTH_OF == k]
        values = values[np.isfinite(values)]
        out[k] = float(np.median(values)) if len(values) else np.nan
    known, usual = np.isfinite(out), usual_lengths(USUAL_HEIGHT_M)
    size = float(np.median(out[known] / usual[known])) if known.any() else 1.0
    return np.where(known, out, usual * size)


def usual_lengths(height_m: float) -> Array:
    """Return the lengths [m] of the bones of an average person, shape (LENGTH_COUNT,)."""
    joints = anthropometric_positions(height_m)[COLUMNS]
    each = np.linalg.norm(joints[BONES[:, 0]] - joints[BONES[:, 1]], axis=1)
    return np.array([each[LENGTH_OF == k].mean() for k in range(LENGTH_COUNT)])


def limbs_m(height_m: float) -> float:
    """Return the sum of the limbs' lengths [m] of an average person of this height."""
    return float(usual_lengths(height_m)[LIMBS].sum())

"""Front and back of legs that only one camera without depth sees.

Legs that cross and legs that swing back look alike from the front. Without depth they continue as they moved, and are
soon a metre apart. The picture's guess shows which one is in front. It flattens a body and errs for long, so it
counts only where the solve contradicts it by more than `ERRS_M`.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import INDEX
from studio.engine.model.triangulation.rays import GUESSED_M
from studio.engine.whole_take.finish.measurements import Measurements

ERRS_M = 0.5
"""Error of the guessed distance of a leg's joint behind the other leg's [m]: in two real recordings 95 % are
smaller."""

HIPS, *LEGS = (np.array([INDEX[f"left_{name}"], INDEX[f"right_{name}"]]) for name in ("hip", "knee", "ankle"))


def add_guessed_legs(
    weight: NDArray[np.float64],
    pull: NDArray[np.float64],
    sites: NDArray[np.float64],
    measurements: Measurements,
    inflation: float,
) -> None:
    """Add the guessed distances between the legs, in place.

    Args:
        weight: information of each joint, shape (frame_count, 21, 3, 3) [1/m2].
        pull: information times difference, shape (frame_count, 21, 3) [1/m].
        sites: the body's joints [m], shape (frame_count, 21, 3).
        measurements: of the same frames, with guesses where they count.
        inflation: factor of variances, because errors last.
    """
    frames, cameras = np.nonzero(np.isfinite(measurements.behind_m).any(axis=2))
    if not len(frames):
        return
    rays, seen = measurements.rays[frames, cameras], measurements.lateral[frames, cameras] > 0.0
    view = rays[:, HIPS].sum(axis=1)
    view /= np.maximum(np.linalg.norm(view, axis=1, keepdims=True), 1e-9)
    behind_m = np.einsum("na,nja->nj", view, sites[frames])
    off_m = behind_m - measurements.behind_m[frames, cameras]
    for pair in LEGS:
        apart_m = np.nan_to_num(off_m[:, pair[0]] - off_m[:, pair[1]])
        beyond_m = np.sign(apart_m) * np.maximum(np.abs(apart_m) - ERRS_M, 0.0)
        counts = (beyond_m != 0.0) & seen[:, [*HIPS, *pair]].all(axis=1)  # unseen joints have no rays
        for joint, side in zip(pair, (0.5, -0.5), strict=True):
            ray = rays[counts, joint]
            at, information = (frames[counts], joint), 1.0 / (inflation * GUESSED_M**2)
            np.add.at(weight, at, information * ray[:, :, None] * ray[:, None])
            np.add.at(pull, at, -information * side * beyond_m[counts, None] * ray)

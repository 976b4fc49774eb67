"""Errors that follow the names that a camera gives, not the body.

A tracker that holds or loses its left hand does so under that name. If it exchanges its sides meanwhile, the error
passes to the other limb of the body, and the first limb is right from then on.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import MIRROR
from studio.engine.whole_take.mending.around import Around

Array = NDArray[np.float64]

ALIKE_SHARE = 0.5
"""A camera errs like others if it agrees with them in more than this share of the instants that can be compared."""


def turned_since(seen: Around, at: slice, errs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where a camera's sides differ from those with which it errs at a pin, shape (count, camera_count).

    Args:
        seen: the cameras.
        at: instants with the pin.
        errs: cameras that contradict it, shape (camera_count,); for the others, the name that most of these have for
            the joint counts.
    """
    row = (at.start + at.stop) // 2
    sides = np.where(errs, seen.exchanged[row], np.mean(seen.exchanged[row, errs]) > 0.5)
    return seen.exchanged != sides


def by_names(seen: Around, turned: NDArray[np.bool_]) -> Around:
    """Return cameras under their own names of left and right, with the sides at a pin as the start. Where one
    exchanges them, its joints are unknown for two instants.

    Args:
        seen: the cameras, with left and right corrected.
        turned: from `turned_since`.
    """
    tracks = turned_back(seen.tracks, turned)
    tracks[exchanges(turned)] = np.nan
    return replace(seen, tracks=tracks, noise=turned_back(seen.noise, turned))


def turned_back(values: NDArray[Any], turned: NDArray[np.bool_]) -> NDArray[Any]:
    """Return values of joints, shape (count, camera_count, 21, ...), under the names of the other side where a camera
    is turned."""
    return np.where(turned.reshape(*turned.shape, *[1] * (values.ndim - 2)), values[:, :, MIRROR], values)


def exchanges(turned: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the two instants around each exchange of a camera, shape (count, camera_count)."""
    change = np.diff(turned, axis=0)
    return np.pad(change, ((1, 0), (0, 0))) | np.pad(change, ((0, 1), (0, 0)))


def alike(
    track: Array, errs: NDArray[np.bool_], turned: NDArray[np.bool_], near_m: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where cameras agree with the erring ones, shape (count, camera_count), and which mostly do, shape
    (camera_count,). Only joints of the same limb are compared.

    Args:
        track: the joint by its names [m], shape (count, camera_count, 3); NaN = unseen.
        errs: cameras that err, shape (camera_count,).
        turned: from `turned_since`, for the same instants.
        near_m: largest distance of joints that agree [m].
    """
    same, compared = np.zeros((2, *turned.shape), dtype=bool)
    for side in (turned, ~turned):
        theirs = np.where((side & errs)[..., None], track, np.nan)
        known = np.isfinite(theirs[..., 0]).any(axis=1)
        middle = np.full((len(track), 1, 3), np.nan)
        middle[known, 0] = np.nanmedian(theirs[known], axis=1)
        off = np.linalg.norm(track - middle, axis=2)
        same |= side & (off < near_m)
        compared |= side & np.isfinite(off)
    return same, same.sum(axis=0) > ALIKE_SHARE * compared.sum(axis=0)

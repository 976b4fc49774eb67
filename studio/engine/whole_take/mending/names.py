"""Errors that follow the names that a camera gives, not the body.

A tracker that holds its left hand fast, or loses it, does so under that name. Where it exchanges its sides meanwhile,
the error goes over to the other limb of the body: what it says of the first one is right from there on.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import MIRROR
from studio.engine.whole_take.mending.around import Around

Array = NDArray[np.float64]

ALIKE_SHARE = 0.5
"""A camera errs as others do that says what they say in more than this share of the instants that can be compared."""


def turned_since(seen: Around, at: slice, errs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where a camera has other sides than those in which it errs at a pin, shape (count, camera_count).

    Args:
        seen: the cameras.
        at: instants with the pin.
        errs: cameras that contradict it, shape (camera_count,); the others would err under the name that most of
            these have for the joint.
    """
    row = (at.start + at.stop) // 2
    sides = np.where(errs, seen.exchanged[row], np.mean(seen.exchanged[row, errs]) > 0.5)
    return seen.exchanged != sides


def by_names(seen: Around, turned: NDArray[np.bool_]) -> Around:
    """Return cameras with left and right as they name them, from the sides at a pin on: where one exchanges them, its
    joints are unknown for two instants.

    Args:
        seen: the cameras, with left and right as they are.
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
    """Return where cameras say what the erring ones say, shape (count, camera_count), and which do so mostly, shape
    (camera_count,). Only what is said of the same limb is compared.

    Args:
        track: the joint by its names [m], shape (count, camera_count, 3); NaN = unseen.
        errs: cameras that err, shape (camera_count,).
        turned: from `turned_since`, for the same instants.
        near_m: how near alike is [m].
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

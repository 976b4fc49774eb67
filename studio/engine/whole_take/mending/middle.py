"""The common path of what several cameras see."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def median_of(tracks: Array) -> Array:
    """Return the median over cameras of tracks, shape (count, camera_count, 21, 3); NaN where none sees the joint."""
    seen = np.isfinite(tracks[..., :1])
    ordered = np.sort(np.where(seen, tracks, np.inf), axis=1)
    count = seen.sum(axis=1)
    low, high = np.maximum((count - 1) // 2, 0)[:, None], np.minimum(count // 2, tracks.shape[1] - 1)[:, None]
    low, high = (
        np.take_along_axis(ordered, np.broadcast_to(k, (*k.shape[:3], 3)), axis=1) for k in (low, high)
    )
    return np.where(count > 0, 0.5 * (low + high)[:, 0], np.nan)


def filled(tracks: Array) -> Array:
    """Return tracks, shape (count, joint_count, 3), with gaps filled in time; what is never seen is at 0."""
    out = tracks.copy()
    places = np.arange(len(out))
    for joint in range(out.shape[1]):
        known = np.isfinite(out[:, joint, 0])
        for axis in range(3):
            own = np.interp(places, places[known], out[known, joint, axis]) if known.any() else 0.0
            out[:, joint, axis] = own
    return out


def path_of(track: Array) -> Array:
    """Return the common path of one joint without gaps, shape (count, 3), from a track of the shape (count,
    camera_count, 3)."""
    return filled(median_of(track[:, :, None]))[:, 0]

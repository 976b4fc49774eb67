"""Which cameras have left and right exchanged, over some time.

Cameras are brought to agree with one another in each instant. That leaves one question per instant: whether all of
them are exchanged. A body does not turn round from one instant to the next, so its sides continue. Where that does
not decide, most cameras are assumed right, and feet and knees to point to the front. The likeliest sequence is found
by dynamic programming.

Source: Viterbi, "Error bounds for convolutional codes", IEEE Trans. Information Theory 13, 1967.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.model.joints import JOINT_COUNT, MIRROR
from studio.engine.solve.fusion.facing import forwardness
from studio.engine.whole_take.mending.middle import filled, median_of

Array = NDArray[np.float64]

SIDES_STEPS = 1.0
"""Standard deviation of the time over which a camera's sides are compared [instants]."""

ROUNDS = 4
"""Most rounds in which cameras' sides are compared with their common skeleton."""

STEP_M = 0.025
"""Extra mean movement of sided joints, from one instant to the next, that is less likely by a factor e."""

RIGHT, AHEAD = 0.1, 0.1
"""Log-likelihoods, in an instant, that a camera has its sides right, and that feet and knees point ahead. Both last,
so one instant counts little."""

_SIDED = np.flatnonzero(MIRROR != np.arange(JOINT_COUNT))


def exchanged_sides(tracks: Array) -> NDArray[np.bool_]:
    """Return the instants at which a camera has left and right exchanged, shape (count, camera_count).

    Args:
        tracks: joints in the stage frame as each camera names them [m], shape (count, camera_count, 21, 3); NaN =
            unseen.
    """
    mirrored = tracks[:, :, MIRROR]
    stays, turns = (_apart(one, tracks[:, 0]) for one in (tracks, mirrored))
    exchanged = _averaged(turns - stays) < 0.0
    exchanged ^= _all_exchanged(np.where(exchanged[..., None, None], mirrored, tracks), exchanged)[:, None]
    for _ in range(ROUNDS):
        as_named = np.where(exchanged[..., None, None], mirrored, tracks)
        middle = gaussian_filter1d(filled(median_of(as_named)), 1.0, axis=0, mode="nearest")
        stays, turns = (_apart(one, middle) for one in (tracks, mirrored))
        before, exchanged = exchanged, _averaged(turns - stays) < 0.0
        if (exchanged == before).all():  # further rounds change nothing
            break
    return exchanged


def _all_exchanged(tracks: Array, exchanged: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Instants at which cameras that agree with one another all have left and right exchanged, shape (count,).

    Args:
        tracks: as in `exchanged_sides`, of cameras that agree.
        exchanged: exchanges that made them agree, shape (count, camera_count).
    """
    middle = median_of(tracks)
    stays, turns = (_apart(one[1:, None], middle[:-1])[:, 0] for one in (middle, middle[:, MIRROR]))
    known = np.isfinite(tracks[..., 0]).any(axis=2)
    right = np.where(exchanged, -RIGHT, RIGHT) + AHEAD * np.nan_to_num(forwardness(tracks))
    right = np.where(known, right, 0.0).sum(axis=1)
    cost = np.stack([-right, right], axis=1)  # of right names, and of exchanged ones
    change = (turns - stays) / STEP_M
    before = np.zeros((len(tracks), 2), dtype=np.int64)
    for k in range(1, len(tracks)):
        steps = cost[k - 1] + np.array([[0.0, change[k - 1]], [change[k - 1], 0.0]])
        before[k] = steps.argmin(axis=1)
        cost[k] += steps.min(axis=1)
    out = np.zeros(len(tracks), dtype=bool)
    state = int(cost[-1].argmin())
    for k in range(len(tracks) - 1, -1, -1):
        out[k] = state == 1
        state = int(before[k, state])
    return out


def _apart(tracks: Array, middle: Array) -> Array:
    """Mean distance of the sided joints, each clipped [m], shape (count, camera_count)."""
    off = tracks[:, :, _SIDED] - middle[:, None, _SIDED]
    distance = np.minimum(np.linalg.norm(off, axis=3), 0.3)
    known = np.isfinite(distance)
    return np.where(known, distance, 0.0).sum(axis=2) / np.maximum(known.sum(axis=2), 1)


def _averaged(values: Array) -> Array:
    return gaussian_filter1d(values, SIDES_STEPS, axis=0, mode="nearest")

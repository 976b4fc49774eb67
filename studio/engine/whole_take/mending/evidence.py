"""What tells of an error of cameras around a pin: lengths of bones, jumps, distance from the pin, and their cost."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from studio.engine.base.geometry import nearest_on_segments
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.middle import path_of

Array = NDArray[np.float64]

NOISE_M = 0.025
"""Standard deviation of an elbow of a camera, and of what it adds to a jump."""

BONE_M = 0.035
"""Standard deviation of a bone's length [m]."""

LIKE_FRAMES = 3.0
"""So many frames of a camera say as much as one, since its noise lasts."""

MOST = 9.0
"""Limit of a squared residual."""

STILL_M_S = 0.15
"""A joint stands still that is slower [m/s]: a foot, or what a camera holds in its place."""

FAST_PERCENT, NEAR_M = 90.0, 0.08
"""A joint is no faster than this percentile of its speeds; and how far from the pin it may be at once [m]."""

TELLS = 30.0
"""Cost below 0 of an error of which more than the pin tells: noise of three cameras reaches 20, three frames 120."""

NO_END = 30.0
"""Cost of an error whose begin or end is not among the frames around the pin."""

AROUND_S, MEDIAN = 0.5, 2.37
"""So far around a jump others tell how large they are without an error [s]; and the median of the square of one of
standard deviation 1."""

TRUNK_M = 0.07
"""No wrist comes nearer to the line from the hips to the neck [m]."""

SLOPE = 3
"""A jump is what is beyond the velocity in so many instants on either side."""


@dataclass(frozen=True)
class Erring:
    """An error of cameras around a pin.

    Attributes:
        rows: the instants at which it lasts.
        joints: indices of the joints that err.
        shift_m: by how much they are off at the pin, in the axes in which it lasts [m], shape (3,).
        in_body: the axes are those of the body, not the stage's.
        follows: they move as they should but for the shift; else what is seen of them says nothing.
        cost: what it costs to take it for true; less than 0 = it explains what is seen.
        held: cameras hold the joint in its place; a cost less than that of any other.
    """

    rows: slice
    joints: tuple[int, ...]
    shift_m: Array
    in_body: bool
    follows: bool
    cost: float
    held: bool = False

    @property
    def is_seen(self) -> bool:
        """Whether more than the pin tells of it."""
        return self.cost < -TELLS


def best_of(
    frames: Array,
    begins: Array,
    ends: Array,
    at: slice,
    joints: tuple[int, ...],
    shift: Array,
    *,
    in_body: bool,
    follows: bool,
) -> Erring:
    """The begin and end of least cost; costs by instant, of `begins` and `ends` before it, shape (count,)."""
    frames = frames / LIKE_FRAMES
    before = np.cumsum(frames[: at.start + 1][::-1])[::-1] + begins[: at.start + 1]
    after = np.concatenate([[0.0], np.cumsum(frames[at.stop :])]) + np.append(ends[at.stop :], 0.0)
    before[: SLOPE + 1] += NO_END  # where no jump is known: `jumps_of`
    after[-SLOPE:] += NO_END
    cost = before[:, None] + after
    apart = at.stop + np.arange(len(after)) - np.arange(len(before))[:, None]
    cost[(apart <= SLOPE)] = np.inf  # a jump has told of the velocity that the other is beyond
    first, last = np.unravel_index(int(cost.argmin()), cost.shape)
    rows = slice(int(first), at.stop + int(last))
    return Erring(rows, joints, shift, in_body, follows, float(cost[first, last]))


def bones_off(tracks: Array, joint: int, lengths: Mapping[str, float], moved: Array | None = None) -> Array:
    """Squared residuals of the bone that ends in a joint, sum over cameras, shape (count,).

    Args:
        tracks: as in `erring`.
        joint: index.
        lengths: of bones by joint [m]; 0 for a joint without one.
        moved: the joint elsewhere [m], shape (count, camera_count, 3); None = as it is.
    """
    if CANONICAL[joint] not in lengths:
        return np.zeros(len(tracks))
    end = tracks[:, :, joint] if moved is None else moved
    off = np.linalg.norm(end - tracks[:, :, int(PARENTS[joint])], axis=2) - lengths[CANONICAL[joint]]
    return np.nan_to_num(np.minimum((off / BONE_M) ** 2, MOST)).sum(axis=1)


def fastest_of(track: Array) -> float:
    """Speed that a joint seldom exceeds [m/s]."""
    speed = np.linalg.norm(np.gradient(path_of(track), STEP_S, axis=0), axis=1)
    return max(float(np.percentile(speed, FAST_PERCENT)), STILL_M_S)


def too_far(track: Array, at: slice, place_m: Array, fastest_m_s: float) -> Array:
    """Squared residuals of what is further from the pin than the joint moves in the time between, sum over cameras,
    shape (count,)."""
    away_s = STEP_S * np.maximum(
        np.maximum(at.start - np.arange(len(track)), np.arange(len(track)) - at.stop + 1), 0
    )
    near = NEAR_M + fastest_m_s * away_s
    beyond = np.maximum(np.linalg.norm(track - place_m, axis=2) - near[:, None], 0.0)
    return np.nan_to_num(np.minimum((beyond / NOISE_M) ** 2, MOST)).sum(axis=1)


def in_trunk(tracks: Array, joint: int) -> Array:
    """Squared residuals of a limb's joint that is seen where the trunk is, and taken for it. Sum over cameras, shape
    (count,).

    Args:
        tracks: as in `erring`.
        joint: index.
    """
    if CANONICAL[joint].split("_")[-1] not in ("wrist", "hand", "knee", "ankle", "toe"):
        return np.zeros(len(tracks))
    point, hips, neck = (tracks[:, :, one] for one in (joint, INDEX["hips"], INDEX["neck"]))
    inside = np.linalg.norm(nearest_on_segments(point, point, hips, neck)[2], axis=2) < TRUNK_M
    return MOST * inside.sum(axis=1)


def jumps_of(local: Array) -> Array:
    """How far joints jump before an instant, beyond their velocity around it, shape of `local`; NaN = unknown.

    A camera's frames are between the instants, so that a jump takes two of them. Where the joint is unseen on one
    side of it, its velocity on the other tells.
    """
    out = np.full_like(local, np.nan)
    k = np.arange(SLOPE + 1, len(local) - SLOPE + 1)
    before = (local[k - 2] - local[k - 1 - SLOPE]) / (SLOPE - 1)
    after = (local[k + SLOPE - 1] - local[k]) / (SLOPE - 1)
    before, after = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    out[k] = local[k] - local[k - 2] - before - after
    return out


def scale_of(jump: Array, noise: Array) -> Array:
    """Standard deviation of jumps without an error, shape (count, camera_count, joint_count): noise, or as they are
    around: a limb that is flung jumps more."""
    reach = round(AROUND_S / STEP_S)
    squared = np.pad((jump**2).sum(axis=3), ((reach, reach), (0, 0), (0, 0)), constant_values=np.nan)
    near = np.moveaxis(sliding_window_view(squared, 2 * reach + 1, axis=0), -1, 1)
    near = near.reshape(len(near), -1, near.shape[-1])
    count = np.isfinite(near).sum(axis=1)
    middle = np.take_along_axis(np.sort(near, axis=1), np.maximum(count - 1, 0)[:, None] // 2, axis=1)[:, 0]
    usual = np.where(count > 0, middle, 0.0) / MEDIAN
    return np.sqrt(np.maximum((NOISE_M * noise) ** 2, usual[:, None]))


def squared_of(jump: Array, scale: Array, most: float = MOST) -> Array:
    """Normalised squares of jumps, each at most `most`, sum over cameras and joints, shape (count,)."""
    squared = (jump**2).sum(axis=3) / scale**2
    return np.nan_to_num(np.minimum(squared, most)).sum(axis=(1, 2))


def stands_still(track: Array) -> NDArray[np.bool_]:
    """Instants at which the joint of most cameras stands still, shape (count,)."""
    smooth = median_filter(path_of(track), (SLOPE, 1), mode="nearest")
    return np.linalg.norm(np.gradient(smooth, STEP_S, axis=0), axis=1) < STILL_M_S

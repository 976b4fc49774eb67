"""Evidence of an error of cameras around a pin: lengths of bones, jumps, distance from the pin, and their cost."""

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
"""Standard deviation of a camera's elbow, and of its share in a jump [m]."""

BONE_M = 0.035
"""Standard deviation of a bone's length [m]."""

LIKE_FRAMES = 3.0
"""Number of a camera's frames that count as one independent frame, because its noise lasts."""

MOST = 9.0
"""Limit of a squared residual."""

STILL_M_S = 0.15
"""Speed below which a joint stands still [m/s]: a foot, or a joint that a camera holds in its place."""

FAST_PERCENT, NEAR_M = 90.0, 0.08
"""Percentile of its speeds that a joint is assumed not to exceed; distance from the pin allowed at once [m]."""

TELLS = 30.0
"""An error is seen by more than the pin if its cost is below minus this: noise of three cameras reaches 20, three
frames 120."""

NO_END = 30.0
"""Cost of an error whose begin or end is not among the frames around the pin."""

AROUND_S, MEDIAN = 0.5, 2.37
"""Time around a jump within which other jumps give the usual size [s]; median of the square of a jump of standard
deviation 1."""

TRUNK_M = 0.07
"""Least distance of a limb's joint from the line from the hips to the neck [m]."""

SLOPE = 3
"""A jump is the movement beyond the velocity over this many instants on either side."""


@dataclass(frozen=True)
class Erring:
    """An error of cameras around a pin.

    Attributes:
        rows: the instants at which it lasts.
        joints: indices of the joints that err.
        shift_m: their error at the pin, in the axes in which the error is constant [m], shape (3,).
        in_body: the axes are those of the body, not the stage's.
        follows: the joints move correctly except for the shift; else their measurements are useless.
        cost: cost of assuming the error; below 0 = it explains the measurements.
        held: cameras hold the joint in its place; the cost is then below that of any other error.
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
        """Whether there is evidence of it besides the pin."""
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
    """The error with the begin and end of least cost.

    Costs are by instant, shape (count,); those of `begins` and `ends` are of a begin or end just before the instant.
    """
    frames = frames / LIKE_FRAMES
    before = np.cumsum(frames[: at.start + 1][::-1])[::-1] + begins[: at.start + 1]
    after = np.concatenate([[0.0], np.cumsum(frames[at.stop :])]) + np.append(ends[at.stop :], 0.0)
    before[: SLOPE + 1] += NO_END  # where no jump is known: `jumps_of`
    after[-SLOPE:] += NO_END
    cost = before[:, None] + after
    apart = at.stop + np.arange(len(after)) - np.arange(len(before))[:, None]
    cost[(apart <= SLOPE)] = np.inf  # each jump would be part of the velocity that the other is compared with
    first, last = np.unravel_index(int(cost.argmin()), cost.shape)
    rows = slice(int(first), at.stop + int(last))
    return Erring(rows, joints, shift, in_body, follows, float(cost[first, last]))


def bones_off(tracks: Array, joint: int, lengths: Mapping[str, float], moved: Array | None = None) -> Array:
    """Squared residuals of the bone that ends in a joint, sum over cameras, shape (count,).

    Args:
        tracks: as in `erring`.
        joint: index.
        lengths: of bones by joint [m]; 0 for a joint without one.
        moved: other places of the joint [m], shape (count, camera_count, 3); None = as measured.
    """
    if CANONICAL[joint] not in lengths:
        return np.zeros(len(tracks))
    end = tracks[:, :, joint] if moved is None else moved
    off = np.linalg.norm(end - tracks[:, :, int(PARENTS[joint])], axis=2) - lengths[CANONICAL[joint]]
    return np.nan_to_num(np.minimum((off / BONE_M) ** 2, MOST)).sum(axis=1)


def fastest_of(track: Array) -> float:
    """Speed that a joint rarely exceeds [m/s]."""
    speed = np.linalg.norm(np.gradient(path_of(track), STEP_S, axis=0), axis=1)
    return max(float(np.percentile(speed, FAST_PERCENT)), STILL_M_S)


def too_far(track: Array, at: slice, place_m: Array, fastest_m_s: float) -> Array:
    """Squared residuals of distances from the pin beyond those that the joint can cover in the time, sum over
    cameras, shape (count,)."""
    away_s = STEP_S * np.maximum(
        np.maximum(at.start - np.arange(len(track)), np.arange(len(track)) - at.stop + 1), 0
    )
    near = NEAR_M + fastest_m_s * away_s
    beyond = np.maximum(np.linalg.norm(track - place_m, axis=2) - near[:, None], 0.0)
    return np.nan_to_num(np.minimum((beyond / NOISE_M) ** 2, MOST)).sum(axis=1)


def in_trunk(tracks: Array, joint: int) -> Array:
    """Squared residuals of a limb's joint that is seen in the trunk, which was taken for it; sum over cameras, shape
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
    """Jumps of joints before an instant, beyond their velocity around it, shape of `local`; NaN = unknown.

    A camera's frames are between the instants, so a jump takes two of them. Where the joint is unseen on one side of
    it, the velocity on the other side is used for both.
    """
    out = np.full_like(local, np.nan)
    k = np.arange(SLOPE + 1, len(local) - SLOPE + 1)
    before = (local[k - 2] - local[k - 1 - SLOPE]) / (SLOPE - 1)
    after = (local[k + SLOPE - 1] - local[k]) / (SLOPE - 1)
    before, after = np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)
    out[k] = local[k] - local[k - 2] - before - after
    return out


def scale_of(jump: Array, noise: Array) -> Array:
    """Standard deviation of jumps without an error, shape (count, camera_count, joint_count): that of noise, or of
    the jumps around if larger, because a limb that is flung jumps more."""
    reach = round(AROUND_S / STEP_S)
    squared = np.pad((jump**2).sum(axis=3), ((reach, reach), (0, 0), (0, 0)), constant_values=np.nan)
    near = np.moveaxis(sliding_window_view(squared, 2 * reach + 1, axis=0), -1, 1)
    near = near.reshape(len(near), -1, near.shape[-1])
    count = np.isfinite(near).sum(axis=1)
    middle = np.take_along_axis(np.sort(near, axis=1), np.maximum(count - 1, 0)[:, None] // 2, axis=1)[:, 0]
    usual = np.where(count > 0, middle, 0.0) / MEDIAN
    return np.sqrt(np.maximum((NOISE_M * noise) ** 2, usual[:, None]))


def squared_of(jump: Array, scale: Array, most: float = MOST) -> Array:
    """Normalised squares of jumps, each clipped to `most`, sum over cameras and joints, shape (count,)."""
    squared = (jump**2).sum(axis=3) / scale**2
    return np.nan_to_num(np.minimum(squared, most)).sum(axis=(1, 2))


def stands_still(track: Array) -> NDArray[np.bool_]:
    """Instants at which the cameras' common path of a joint stands still, shape (count,)."""
    smooth = median_filter(path_of(track), (SLOPE, 1), mode="nearest")
    return np.linalg.norm(np.gradient(smooth, STEP_S, axis=0), axis=1) < STILL_M_S

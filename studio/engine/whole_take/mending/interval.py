"""From when to when cameras contradict a pin, and how: an error has a begin and an end, and the pin is between.

Two kinds of errors are tried. Some joints of the limb are shifted, in the axes of the stage or of the body: then all
of them jump by the shift where it begins and ends, and their bones have their lengths without it. Or what is seen of
the joint and of what it carries says nothing: then its bone seldom has its length, and they jump anyhow where that
begins and ends, unless they stand still there: a foot is held where it stood.

The cost of an error is a sum over its frames, its begin and its end, so that its begin and its end are each found on
their own, by trying all. Squared residuals are normalised and limited.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from studio.engine.edits.timing import eased
from studio.engine.model.calibration import Performer
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.middle import filled, median_of

Array = NDArray[np.float64]

NOISE_M = 0.025
"""Standard deviation of an elbow of a camera, and of what it adds to a jump."""

BONE_M = 0.035
"""Standard deviation of a bone's length [m]."""

PIN_M, JUMP_M, LIKE_BONES, ROUNDS = 0.03, 0.05, 15.0, 4
"""Of a shift: standard deviations of what is seen at the pin, and of an elbow's jump [m]; so many frames of a bone
say as much as one; and rounds of reweighting."""

REFINED = 2
"""A shift and its begin and end are found anew so often before errors are compared."""

SHORT_M = 0.1
"""A shorter bone tells little [m]."""

LIKE_FRAMES = 3.0
"""So many frames of a camera say as much as one, since its noise lasts."""

MOST = 9.0
"""Limit of a squared residual."""

MOST_OF_SHIFT = 36.0
"""The same of a jump that is less than the shift: errors of this kind begin and end at once."""

UNTOLD = 3.0
"""Squared residual that stands for a frame, or for a jump, of which nothing is expected."""

STILL_M_S = 0.15
"""A joint stands still that is slower [m/s]: a foot, or what a camera holds in its place."""

FAST_PERCENT, NEAR_M = 90.0, 0.08
"""A joint is no faster than this percentile of its speeds; and how far from the pin it may be at once [m]."""

TELLS = 30.0
"""Cost below 0 of an error of which more than the pin tells: noise of three cameras reaches 20, three frames 120."""

NO_END = 30.0
"""Cost of an error whose begin or end is not among the frames around the pin."""

HELD_M_S, HELD_STEPS, HELD_S = 0.15, 4, 0.2
"""A camera holds a joint in its place that is slower over so many instants [m/s], for so long around the pin [s]."""

FADE_S = 0.5
"""An error of which nothing but the pin tells fades in so long before and after it [s]."""

AROUND_S, MEDIAN = 0.5, 2.37
"""So far around a jump others tell how large they are without an error [s]; and the median of the square of one of
standard deviation 1."""

SLOPE = 3
"""A jump is what is beyond the velocity in so many instants on either side."""

_CARRIES = {"elbow": ("wrist", "hand"), "wrist": ("hand",), "knee": ("ankle", "toe"), "ankle": ("toe",)}
_WITH_PARENT = ("wrist", "hand", "ankle", "toe")


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
    """

    rows: slice
    joints: tuple[int, ...]
    shift_m: Array
    in_body: bool
    follows: bool
    cost: float

    @property
    def is_seen(self) -> bool:
        """Whether more than the pin tells of it."""
        return self.cost < -TELLS


def limb_of(joint: int) -> list[tuple[int, ...]]:
    """Return the joints that may err together with one: it and what it carries, then with its parent too."""
    side, _, part = CANONICAL[joint].partition("_")
    own = (joint, *(INDEX[f"{side}_{other}"] for other in _CARRIES.get(part, ())))
    return [own, (int(PARENTS[joint]), *own)] if part in _WITH_PARENT else [own]


def erring(
    tracks: Array,
    noise: Array,
    joint: int,
    at: slice,
    place_m: Array,
    axes: Array,
    performer: Performer | None,
) -> Erring:
    """Return the likeliest error around a pin.

    Args:
        tracks: joints of the cameras that contradict the pin [m], shape (count, camera_count, 21, 3); NaN = unseen.
        noise: of each relative to an elbow, shape (count, camera_count, 21).
        joint: index of the pin's joint.
        at: instants with the pin.
        place_m: its places [m], shape (count, 3).
        axes: of the body, shape (count, 3, 3).
        performer: has the lengths of bones; None = unknown.
    """
    bones = {} if performer is None else performer.bones_m()
    lengths = {name: length for name, length in bones.items() if length > SHORT_M}
    last, scale = len(tracks) - 1, _scale(_jumps(tracks), noise)
    every = np.ones(tracks.shape[:2], dtype=bool)
    found = []
    for joints in limb_of(joint):
        for in_body in (False, True):
            own = axes if in_body else np.broadcast_to(np.eye(3), axes.shape)
            tried = _Shifts(
                tracks, scale[..., list(joints)], joint, joints, at, place_m[at], own, lengths, in_body
            )
            for row in (
                slice(max(at.start - 1, 0), at.start),
                at,
                slice(min(at.stop, last), min(at.stop, last) + 1),
            ):
                off = tried.off_m(row)
                one = tried.by(off, off)
                for _ in range(REFINED):
                    one = tried.by(shift_of(one, tracks, noise, every[one.rows], own, performer), off)
                found.append(one)
    own = limb_of(joint)[0]
    told = [one for one in own if CANONICAL[one] in lengths]
    right = sum((_bones(tracks, one, lengths) for one in told), np.zeros(len(tracks)))
    right += _too_far(tracks[:, :, joint], at, place_m[at].mean(axis=0))
    untold = UNTOLD * np.isfinite(tracks[:, :, told, 0]).sum(axis=(1, 2))
    jump = _jumps(tracks[:, :, list(own)])
    jumps = UNTOLD * np.isfinite(jump[..., 0]).sum(axis=(1, 2)) - _squared(jump, scale[..., list(own)])
    unmoved = np.where(_still(tracks[:, :, joint]), np.minimum(jumps, 0.0), jumps)
    found.append(_best(untold - right, unmoved, unmoved, at, own, np.zeros(3), in_body=False, follows=False))
    best = min(found, key=lambda one: one.cost)
    rows = None if best.is_seen and best.follows else held(tracks, joint, at)
    if rows is None:
        return best
    if best.is_seen:
        rows = slice(min(rows.start, best.rows.start), max(rows.stop, best.rows.stop))
    return Erring(rows, own, np.zeros(3), False, False, -np.inf)


def held(tracks: Array, joint: int, at: slice) -> slice | None:
    """Return the instants around a pin at which most cameras hold a joint in its place; None where they do not.

    Args:
        tracks, joint, at: as in `erring`.
    """
    track = tracks[:, :, joint]
    moved = np.linalg.norm(track[HELD_STEPS:] - track[:-HELD_STEPS], axis=2)
    still, seen = moved < HELD_STEPS * STEP_S * HELD_M_S, np.isfinite(moved)
    count = len(track) - 1  # of steps from one instant to the next
    links, known = np.zeros((2, count, track.shape[1]), dtype=bool)
    for step in range(HELD_STEPS):  # a step is still that belongs to a longer one that is
        links[step : step + len(still)] |= still
        known[step : step + len(seen)] |= seen
    most = links.sum(axis=1) >= np.maximum(0.5 * known.sum(axis=1), known.any(axis=1))
    first, last = at.start, at.stop - 1
    while first > 0 and most[first - 1]:
        first -= 1
    while last < count and most[last]:
        last += 1
    held_s = (last - first) * STEP_S
    return slice(first, last + 1) if most[first:last].all() and held_s >= HELD_S else None


def fading(tracks: Array, joint: int, at: slice, place_m: Array) -> tuple[Erring, Array]:
    """Return an error of which nothing but the pin tells, and its share in each of its instants: it fades.

    Args:
        tracks, joint, at, place_m: as in `erring`.

    Returns:
        The error, and shares 0..1, shape (row_count,).
    """
    reach = round(FADE_S / STEP_S)
    rows = slice(max(at.start - reach, 0), min(at.stop + reach, len(tracks)))
    k = np.arange(rows.start, rows.stop)
    away = np.maximum(np.maximum(at.start - k, k - at.stop + 1), 0)
    shift = np.nanmean(tracks[at, :, joint] - place_m[at][:, None], axis=(0, 1))
    error = Erring(rows, limb_of(joint)[0], shift, in_body=False, follows=True, cost=0.0)
    return error, eased(1.0 - away / (reach + 1))


class _Shifts:
    """Errors that are a shift of some joints, in some axes."""

    def __init__(
        self,
        tracks: Array,
        scale: Array,
        joint: int,
        joints: tuple[int, ...],
        at: slice,
        place_m: Array,
        own: Array,
        lengths: Mapping[str, float],
        in_body: bool,
    ) -> None:
        self._tracks, self._scale, self._joint, self._joints, self._at = tracks, scale, joint, joints, at
        self._own, self._lengths, self._in_body = own, lengths, in_body
        self._there = place_m.mean(axis=0)
        self._local = np.einsum("tba,tcjb->tcja", own, tracks[:, :, list(joints)])
        self._jump = _jumps(self._local)
        self._plain = _squared(self._jump, scale)
        self._frames = _bones(tracks, joints[0], lengths) + _too_far(tracks[:, :, joint], at, self._there)

    def off_m(self, row: slice) -> Array:
        """By how much the joint is off the pin's place in some instants [m], shape (3,): where an error begins or
        ends at the pin, one beside it tells more."""
        pin = np.einsum("tba,b->ta", self._own[row], self._there)
        off = (self._local[row, :, self._joints.index(self._joint)] - pin[:, None]).reshape(-1, 3)
        known = np.isfinite(off[:, 0])
        return off[known].mean(axis=0) if known.any() else np.zeros(3)

    def by(self, shift: Array, off: Array) -> Erring:
        """The likeliest error that is a shift [m], shape (3,), off by `off` [m] at the pin."""
        away = np.einsum("tab,b->ta", self._own, shift)[:, None]
        top, tracks = self._joints[0], self._tracks
        frames = _bones(tracks, top, self._lengths, tracks[:, :, top] - away)
        frames += _too_far(tracks[:, :, self._joint] - away, self._at, self._there) - self._frames
        begins, ends = (
            _squared(self._jump + sign * shift, self._scale, MOST_OF_SHIFT) - self._plain
            for sign in (-1.0, 1.0)
        )
        found = _best(frames, begins, ends, self._at, self._joints, off, in_body=self._in_body, follows=True)
        return replace(found, cost=found.cost + float(((shift - off) ** 2).sum()) / PIN_M**2)


def shift_of(
    found: Erring,
    tracks: Array,
    noise: Array,
    errs: NDArray[np.bool_],
    own: Array,
    performer: Performer | None,
) -> Array:
    """Return by how much joints are shifted while an error lasts [m], shape (3,): as they are off at the pin, as they
    jump where it begins and ends, and so that their bone gets its length.

    Args:
        found: the error.
        tracks, noise: of all cameras, as in `erring`.
        errs: where each camera errs, shape (row_count, camera_count).
        own: axes in which the error lasts, shape (count, 3, 3).
        performer: as in `erring`.
    """
    joints = list(found.joints)
    jump = _jumps(np.einsum("tba,tcjb->tcja", own, tracks[:, :, joints]))
    edges = [(found.rows.start, errs[0], 1.0), (found.rows.stop, errs[-1], -1.0)]
    told = [(sign * jump[k][by], noise[k][by][:, joints]) for k, by, sign in edges if k < len(jump)]
    off = np.concatenate([np.empty((0, 3)), *(one.reshape(-1, 3) for one, _ in told)])
    sigma = JUMP_M * np.concatenate([np.empty(0), *(one.ravel() for _, one in told)])
    off, sigma = off[np.isfinite(off[:, 0])], sigma[np.isfinite(off[:, 0])]
    top, length = joints[0], None if performer is None else performer.bones_m().get(CANONICAL[joints[0]])
    bones = np.einsum("tba,tcb->tca", own, tracks[:, :, top] - tracks[:, :, int(PARENTS[top])])[found.rows][
        errs
    ]
    bones = bones[np.isfinite(bones[:, 0])]
    shift = found.shift_m
    for _ in range(ROUNDS):
        squared = ((off - shift) ** 2).sum(axis=1) / sigma**2
        weight = 1.0 / sigma**2 / (1.0 + squared / MOST)
        normal, right = np.eye(3) / PIN_M**2, found.shift_m / PIN_M**2
        normal, right = normal + weight.sum() * np.eye(3), right + weight @ off
        if length is not None and length > SHORT_M and len(bones):
            apart = np.linalg.norm(bones - shift, axis=1)
            unit = (bones - shift) / np.maximum(apart, 1e-6)[:, None]
            beyond = apart - length
            weight = 1.0 / BONE_M**2 / (1.0 + (beyond / BONE_M) ** 2 / MOST) / LIKE_BONES
            normal = normal + np.einsum("k,ka,kb->ab", weight, unit, unit)
            right = right + np.einsum("k,ka->a", weight * (beyond + unit @ shift), unit)
        shift = np.linalg.solve(normal, right)
    return shift


def _best(
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
    before[:SLOPE] += NO_END
    after[-SLOPE:] += NO_END
    rows = slice(int(before.argmin()), at.stop + int(after.argmin()))
    return Erring(rows, joints, shift, in_body, follows, float(before.min() + after.min()))


def _bones(tracks: Array, joint: int, lengths: Mapping[str, float], moved: Array | None = None) -> Array:
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


def _too_far(track: Array, at: slice, place_m: Array) -> Array:
    """Squared residuals of what is further from the pin than the joint moves in the time between, sum over cameras,
    shape (count,)."""
    away_s = STEP_S * np.maximum(
        np.maximum(at.start - np.arange(len(track)), np.arange(len(track)) - at.stop + 1), 0
    )
    speed = np.linalg.norm(np.gradient(filled(median_of(track[:, :, None]))[:, 0], STEP_S, axis=0), axis=1)
    near = NEAR_M + max(float(np.percentile(speed, FAST_PERCENT)), STILL_M_S) * away_s
    beyond = np.maximum(np.linalg.norm(track - place_m, axis=2) - near[:, None], 0.0)
    return np.nan_to_num(np.minimum((beyond / NOISE_M) ** 2, MOST)).sum(axis=1)


def _jumps(local: Array) -> Array:
    """How far joints jump before an instant, beyond their velocity around it, shape of `local`; NaN = unknown.

    A camera's frames are between the instants, so that a jump takes two of them.
    """
    out = np.full_like(local, np.nan)
    k = np.arange(SLOPE + 1, len(local) - SLOPE + 1)
    before = local[k - 2] - local[k - 1 - SLOPE]
    after = local[k + SLOPE - 1] - local[k]
    out[k] = local[k] - local[k - 2] - (before + after) / (SLOPE - 1)
    return out


def _scale(jump: Array, noise: Array) -> Array:
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


def _squared(jump: Array, scale: Array, most: float = MOST) -> Array:
    """Normalised squares of jumps, each at most `most`, sum over cameras and joints, shape (count,)."""
    squared = (jump**2).sum(axis=3) / scale**2
    return np.nan_to_num(np.minimum(squared, most)).sum(axis=(1, 2))


def _still(track: Array) -> NDArray[np.bool_]:
    """Instants at which the joint of most cameras stands still, shape (count,)."""
    smooth = median_filter(filled(median_of(track[:, :, None]))[:, 0], (SLOPE, 1), mode="nearest")
    return np.linalg.norm(np.gradient(smooth, STEP_S, axis=0), axis=1) < STILL_M_S

"""Begin, end and kind of an error of cameras that contradict a pin; the pin is between begin and end.

Two kinds of errors are tried. In the first, some joints of the limb are shifted, in the axes of the stage or of the
body: all of them jump by the shift at its begin and end, and without it their bones have the right lengths. In the
second, the joint and those that it carries are measured uselessly: its bone rarely has its length, and they jump
arbitrarily at begin and end, unless they stand still there, as a foot that is held where it stood. A wrist that is
seen in the trunk was confused with it, for as long as it is seen there.

The cost of an error is a sum over its frames, its begin and its end, so begin and end are each found on their own, by
trying all. Squared residuals are normalised and clipped.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from studio.engine.edits.timing import eased
from studio.engine.model.calibration import Performer
from studio.engine.model.joints import CANONICAL, INDEX, PARENTS
from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.evidence import (
    BONE_M,
    NEAR_M,
    TELLS,
    Erring,
    best_of,
    bones_off,
    fastest_of,
    in_trunk,
    jumps_of,
    scale_of,
    squared_of,
    stands_still,
    too_far,
)
from studio.engine.whole_take.mending.middle import median_of, path_of
from studio.engine.whole_take.mending.shifts import SHORT_M, ShiftErrors, shift_of

Array = NDArray[np.float64]

REFINED = 2
"""Number of refinements of a shift, its begin and its end before errors are compared."""

UNTOLD = 3.0
"""Squared residual that stands for a useless frame, or for an arbitrary jump."""

HELD_M_S, HELD_STEPS, HELD_S = 0.15, 4, 0.2
"""A camera holds a joint in its place if it is slower than this [m/s] over this many instants, for at least this long
around the pin [s]."""

HELD_COST = -1000.0
"""Cost of a joint that is held in its place, below that of any other error. The number of steps in which a camera
holds it, and other evidence of an error, reduce it further."""

STANDS_COST = -2.0 * TELLS
"""Largest cost of a shift of a joint that stands still; with a larger one the joint counts as held, since it may also
stand still by itself."""

LATE_S = 0.2
"""Delay with which a shank shows that its foot is held [s]: at first the knee turns about it, as about a foot that
stands."""

FADE_S = 0.5
"""Time before and after the pin in which an error without other evidence fades [s]."""

_CARRIES = {"elbow": ("wrist", "hand"), "wrist": ("hand",), "knee": ("ankle", "toe"), "ankle": ("toe",)}
_WITH_PARENT = ("wrist", "hand", "ankle", "toe")


def limb_of(joint: int) -> list[tuple[int, ...]]:
    """Return the groups of joints that may err together: a joint and those that it carries, then with its parent."""
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
    told: NDArray[np.bool_] | None = None,
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
        told: where a camera's distance from the pin counts, shape (count, camera_count); None = everywhere.
    """
    near = tracks[:, :, joint] if told is None else np.where(told[..., None], tracks[:, :, joint], np.nan)
    bones = {} if performer is None else performer.bones_m()
    lengths = {name: length for name, length in bones.items() if length > SHORT_M}
    last, scale = len(tracks) - 1, scale_of(jumps_of(tracks), noise)
    every, fastest_m_s = np.ones(tracks.shape[:2], dtype=bool), fastest_of(near)
    found = []
    for joints in limb_of(joint):
        for in_body in (False, True):
            own = axes if in_body else np.broadcast_to(np.eye(3), axes.shape)
            tried = ShiftErrors(
                tracks,
                near,
                scale[..., list(joints)],
                joint,
                joints,
                at,
                place_m[at],
                own,
                lengths,
                fastest_m_s,
                in_body,
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
    measured = [one for one in own if CANONICAL[one] in lengths]
    right = sum((bones_off(tracks, one, lengths) for one in measured), np.zeros(len(tracks)))
    right += too_far(near, at, place_m[at].mean(axis=0), fastest_m_s)
    of_trunk = in_trunk(tracks, joint)
    taken = bool(of_trunk[at].any())
    if taken:  # confused with the trunk, and wrong for as long as that lasts
        right = np.where(of_trunk > 0.0, right + of_trunk, 0.0)
    untold = UNTOLD * np.isfinite(tracks[:, :, measured, 0]).sum(axis=(1, 2))
    jump = jumps_of(tracks[:, :, list(own)])
    jumps = UNTOLD * np.isfinite(jump[..., 0]).sum(axis=(1, 2)) - squared_of(jump, scale[..., list(own)])
    unmoved = np.where(stands_still(tracks[:, :, joint]), np.minimum(jumps, 0.0), jumps)
    found.append(
        best_of(untold - right, unmoved, unmoved, at, own, np.zeros(3), in_body=False, follows=False)
    )
    best = min(found, key=lambda one: one.cost)
    sure = _is_shifted(best) or (best.is_seen and taken)
    rows, still = (None, None) if sure else held(tracks, joint, at)
    if rows is None or still is None:
        return best
    fits = _fits(tracks, joint, rows)
    if best.is_seen and not best.follows:
        rows = _where_wrong(fits, rows, best.rows)
    rows = left_behind(tracks, joint, at, rows, fits)
    cost = HELD_COST + min(best.cost, 0.0) - float(still[rows.start : rows.stop - 1].sum())
    return Erring(rows, own, np.zeros(3), False, False, cost, held=True)


def likelier(one: Erring, other: Erring) -> bool:
    """Whether an error is likelier than another, of the same pin."""
    if one.held != other.held:
        return _is_shifted(one) if other.held else not _is_shifted(other)
    return one.cost < other.cost


def _is_shifted(error: Erring) -> bool:
    """Whether the error counts as a shift even if the joint stands still."""
    return error.follows and error.cost < STANDS_COST


def held(tracks: Array, joint: int, at: slice) -> tuple[slice | None, NDArray[np.int64]]:
    """Return the instants around a pin at which most cameras hold a joint in its place, None = they do not; and the
    number of cameras that do so from each instant to the next, shape (count - 1,).

    Args:
        tracks, joint, at: as in `erring`.
    """
    track = tracks[:, :, joint]
    moved = np.linalg.norm(track[HELD_STEPS:] - track[:-HELD_STEPS], axis=2)
    still, seen = moved < HELD_STEPS * STEP_S * HELD_M_S, np.isfinite(moved)
    count = len(track) - 1  # of steps from one instant to the next
    links, known = np.zeros((2, count, track.shape[1]), dtype=bool)
    for step in range(HELD_STEPS):  # every step within a still span is still
        links[step : step + len(still)] |= still
        known[step : step + len(seen)] |= seen
    most = links.sum(axis=1) >= np.maximum(0.5 * known.sum(axis=1), known.any(axis=1))
    first, last = at.start, at.stop - 1
    while first > 0 and most[first - 1]:
        first -= 1
    while last < count and most[last]:
        last += 1
    held_s = (last - first) * STEP_S
    rows = slice(max(first - 1, 0), min(last + 2, len(track)))  # a jump is between instants
    return (rows if most[first:last].all() and held_s >= HELD_S else None), links.sum(axis=1)


def _fits(tracks: Array, joint: int, rows: slice) -> Array:
    """Whether the bone of a joint that is held at some instants has its usual length of the other instants, shape
    (count,); NaN = unknown."""
    middle = median_of(tracks[:, :, [joint, int(PARENTS[joint])]])
    length = median_filter(np.linalg.norm(middle[:, 0] - middle[:, 1], axis=1), 3, mode="nearest")
    outside = np.concatenate([length[: rows.start], length[rows.stop :]])
    known = np.isfinite(length)
    usual = np.nanmedian(outside) if np.isfinite(outside).any() else np.nan
    return np.where(known & np.isfinite(usual), np.abs(length - usual) < 2.0 * BONE_M, np.nan)


def _where_wrong(fits: Array, rows: slice, other: slice) -> slice:
    """Instants at which a joint is held, with the others before and after if its bone is wrong there: then the false
    place moved."""

    def wrong(first: int, stop: int) -> bool:
        found = fits[first:stop][np.isfinite(fits[first:stop])]
        return len(found) > 0 and float(found.mean()) < 0.5

    return slice(
        other.start if wrong(other.start, rows.start) else rows.start,
        other.stop if wrong(rows.stop, other.stop) else rows.stop,
    )


def left_behind(tracks: Array, joint: int, at: slice, rows: slice, fits: Array) -> slice:
    """Return the instants around a pin at which a foot that cameras hold has left its place; for other joints all.

    A foot often stands. A held foot is right at first, if it does not jump to the place, for as long as the shank
    keeps its length. The same holds backwards from the end.

    Args:
        tracks, joint, at: as in `erring`.
        rows: instants at which it is held.
        fits: whether its bone has its length, shape (count,); NaN = unknown.
    """
    if CANONICAL[joint].split("_")[-1] not in ("ankle", "toe"):
        return rows
    track = path_of(tracks[:, :, joint])
    moved = np.linalg.norm(track[2:] - track[:-2], axis=1)  # a jump takes two instants
    first, stop = rows.start, rows.stop
    while 2 <= first < at.start and fits[first] == 1.0 and moved[first - 2] < NEAR_M:
        first += 1
    while at.stop < stop <= len(moved) and fits[stop - 1] == 1.0 and moved[stop - 1] < NEAR_M:
        stop -= 1
    late = round(LATE_S / STEP_S)
    return slice(max(rows.start, first - late), min(rows.stop, stop + late))


def fading(tracks: Array, joint: int, at: slice, place_m: Array) -> tuple[Erring, Array]:
    """Return an error without evidence but the pin, and its share in each of its instants: it fades.

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

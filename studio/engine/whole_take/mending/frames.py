"""The cameras' frames as edits leave them: doubted ones, and those that a pin proves wrong, mended around it."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.base.arrays import runs
from studio.engine.edits.edit import Edit, PinEdit
from studio.engine.edits.frames import Frames, doubted
from studio.engine.edits.timing import of_kind
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import DRAWN
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR, PARENTS
from studio.engine.whole_take.mending.around import Around, around, axes_of
from studio.engine.whole_take.mending.changed import changed_frames
from studio.engine.whole_take.mending.evidence import Erring
from studio.engine.whole_take.mending.habit import Habit, habit
from studio.engine.whole_take.mending.interval import erring, fading, limb_of
from studio.engine.whole_take.mending.middle import median_of
from studio.engine.whole_take.mending.names import alike, by_names, exchanges, turned_back, turned_since
from studio.engine.whole_take.mending.shifts import shift_of
from studio.engine.whole_take.mending.spread import spread
from studio.engine.whole_take.mending.told import PinFinding, told_of, told_of_unseen

Array = NDArray[np.float64]

REACH_S = 2.5
"""How far from a pin an error may last [s]."""

WRONG_M = 0.06
"""Smallest error of a camera that is taken to last [m]."""

ALIKE_M = 0.15
"""A camera that saw nothing at the pin errs like the others where it says what they say [m]."""

BEYOND_M = 0.1
"""A pin may be so far out of reach [m]: floor, click, bones and the limb's root are each off by two or three
centimetres."""

PARENT_FRAMES = 1.0
"""Smoothing of a joint's path about which its child's is found [instants]."""

BONE_SHARE = (0.8, 1.2)
"""A bone to a pin has this share of its length."""

LIMB = ("elbow", "wrist", "hand", "knee", "ankle", "toe")
"""Joints whose parent is of their limb."""


def edited_frames(
    frames: Frames,
    calibration: Calibration,
    edits: Sequence[Edit],
    *,
    lifted_m: float = 0.0,
    tell: Callable[[PinFinding], None] = lambda found: None,
) -> Frames:
    """Return a performer's frames as edits leave them; without edits of frames the same object.

    Args:
        frames: by camera, in order of time, of one performer.
        calibration: cameras, clocks and the performer's proportions.
        edits: of this performer.
        lifted_m: how far the solve raises the performer above what the cameras see [m]; pins are on its floor.
        tell: receives each thing that pins found wrong.
    """
    frames = doubted(frames, calibration, edits)
    for pins in _together([pin for pin in of_kind(edits, PinEdit) if pin.joint in INDEX]):
        frames = _mended(frames, calibration, pins, lifted_m, tell)
    return frames


def _together(pins: Sequence[PinEdit]) -> list[list[PinEdit]]:
    """Pins of one joint that are near one another in time."""
    groups: list[list[PinEdit]] = []
    for pin in sorted(pins, key=lambda pin: (pin.joint, pin.start_s)):
        last = groups[-1][-1] if groups else None
        if last is not None and last.joint == pin.joint and pin.start_s - last.end_s < REACH_S:
            groups[-1].append(pin)
        else:
            groups.append([pin])
    return groups


def _mended(
    frames: Frames,
    calibration: Calibration,
    pins: Sequence[PinEdit],
    lifted_m: float,
    tell: Callable[[PinFinding], None],
) -> Frames:
    """Return frames mended around some pins of one joint."""
    begin = min(pin.start_s for pin in pins) - REACH_S
    end = max(pin.end_s for pin in pins) + REACH_S
    joint, performer = INDEX[pins[0].joint], calibration.performer
    limb = limb_of(joint)[-1]
    seen = around(frames, calibration, begin, end, doubted=[*limb, *MIRROR[list(limb)]])
    if seen is None:
        return frames
    if not np.isfinite(seen.tracks[:, :, joint]).any():
        return frames  # a single camera without depth places nothing
    pinned, place = _pinned(seen, pins, lifted_m)
    middle = seen.middle()
    axes, origin = axes_of(middle, joint)
    if performer is not None:
        out = place - origin
        reach_m = performer.reach_m()[joint]
        far = np.linalg.norm(out, axis=1) / reach_m
        place = origin + out / np.maximum(far, 1.0)[:, None]
        pinned &= far < max(DRAWN, 1.0 + BEYOND_M / reach_m)  # from further off it says nothing about cameras
        if not pinned.any():
            return frames
    places, gone = np.full((*seen.tracks.shape[:3], 3), np.nan), np.zeros(seen.tracks.shape[:3], dtype=bool)
    lasts = np.zeros(seen.tracks.shape[:2], dtype=bool)  # where nothing is known of the joint
    for at in (slice(*run) for run in runs(pinned)):
        errs = _contradict(seen.tracks[:, :, joint], place, at)
        if not errs.any():
            continue
        found, named, turned = _likeliest(seen, joint, at, place, axes, performer, errs)
        share = None
        if not found.is_seen:
            found, share = fading(seen.tracks[:, errs], joint, at, place)
        rows, own_turned = np.arange(found.rows.start, found.rows.stop), turned[found.rows]
        of_all = _in_all_cameras(named, joint, errs, turned, found)
        tell(told_of(seen, pins, at, found, of_all, turned, fades=share is not None))
        put, left = np.full_like(places, np.nan), np.zeros_like(gone)
        if found.follows:
            own = axes if found.in_body else np.broadcast_to(np.eye(3), axes.shape)
            if share is None:
                shift = shift_of(found, named.tracks, named.noise, of_all, own, performer)
                shifts = np.broadcast_to(shift, (len(rows), 3))
            else:
                shifts = share[:, None] * found.shift_m
            shifted = np.einsum("tab,tb->ta", own[rows], shifts)[:, None]
            for other in found.joints:
                moved = named.tracks[rows, :, other] - shifted
                put[rows, :, other] = np.where(of_all[..., None], moved, np.nan)
        else:
            lasts[rows] |= of_all & ~own_turned
            left[rows, :, joint] |= of_all & own_turned
            for other in found.joints[1:]:
                left[rows, :, other] |= of_all
        if share is None:
            _leave_out_ends(left, found, of_all, at)
        put, left = turned_back(put, turned), turned_back(left, turned)
        between = exchanges(turned)[rows] & of_all
        for other in found.joints:
            left[rows, :, MIRROR[other]] |= between
            if found.follows or other != joint:
                left[rows, :, other] |= between
        if not found.follows:
            lasts[rows] |= between
        places, gone = np.where(np.isfinite(put), put, places), gone | left
    unseen, guessed = _unseen_about(seen, joint, pinned), np.zeros(places.shape[:3], dtype=bool)
    for run in runs(unseen):
        tell(told_of_unseen(seen, pins, joint, slice(*run)))
    if lasts.any() or unseen.any():
        path = _path(seen, joint, middle, axes, origin, lasts, pinned, place, performer)
        known = np.isfinite(seen.tracks[:, :, joint, 0])
        put = lasts & known | unseen[:, None]
        places[:, :, joint] = np.where(put[..., None], path[:, None], places[:, :, joint])
        guessed[:, :, joint] = put
    return changed_frames(frames, calibration, seen, places, gone, guessed)


def _contradict(tracks: Array, place: Array, at: slice) -> NDArray[np.bool_]:
    """The cameras whose joint, shape (count, camera_count, 3), contradicts the pin, shape (camera_count,)."""
    off = np.linalg.norm(tracks[at] - place[at][:, None], axis=2)
    return np.fmax.reduce(off, axis=0, initial=0.0) > WRONG_M


def _likeliest(
    seen: Around,
    joint: int,
    at: slice,
    place: Array,
    axes: Array,
    performer: Performer | None,
    errs: NDArray[np.bool_],
) -> tuple[Erring, Around, NDArray[np.bool_]]:
    """The likeliest error of the cameras that contradict a pin, the cameras as it follows them, and where their names
    are then those of the other side, shape (count, camera_count)."""
    nowhere = np.zeros(seen.exchanged.shape, dtype=bool)
    found = erring(seen.tracks[:, errs], seen.noise[:, errs], joint, at, place, axes, performer)
    turned = turned_since(seen, at, errs)
    if not turned.any():
        return found, seen, nowhere
    named, here = by_names(seen, turned), np.where(exchanges(turned)[..., None, None], np.nan, seen.tracks)
    own, other = (
        erring(
            tracks[:, errs], noise[:, errs], joint, at, place, axes, performer, told=~turned[:, errs]
        )  # both from the same readings
        for tracks, noise in ((here, seen.noise), (named.tracks, named.noise))
    )
    by_name = other.is_seen and other.cost < own.cost and turned[other.rows].any()
    return (other, named, turned) if by_name else (found, seen, nowhere)


def _in_all_cameras(
    seen: Around, joint: int, errs: NDArray[np.bool_], turned: NDArray[np.bool_], found: Erring
) -> NDArray[np.bool_]:
    """Where cameras err: those that contradict the pin, and those that say what these do most of the time, shape
    (row_count, camera_count)."""
    near = 0.5 * float(np.linalg.norm(found.shift_m)) if found.follows else ALIKE_M
    same, mostly = alike(seen.tracks[found.rows, :, joint], errs, turned[found.rows], near)
    return errs | mostly & (found.follows | same)


def _leave_out_ends(gone: NDArray[np.bool_], found: Erring, errs: NDArray[np.bool_], at: slice) -> None:
    """Leave out what may be on either side of the jump where an error begins or ends, in place; not at the pin, nor
    what is put on a path."""
    first, stop = found.rows.start, found.rows.stop
    inside = 1 if found.follows else 0
    for rows, by in ((range(first - 1, first + inside), errs[0]), (range(stop - inside, stop + 1), errs[-1])):
        for row in rows:
            if 0 <= row < len(gone) and not at.start <= row < at.stop:
                gone[row, :, list(found.joints)] |= by


def _path(
    seen: Around,
    joint: int,
    middle: Array,
    axes: Array,
    origin: Array,
    lasts: NDArray[np.bool_],
    pinned: NDArray[np.bool_],
    place: Array,
    performer: Performer | None,
) -> Array:
    """The path of a joint of which cameras say nothing while they err, shape (count, 3) [m]: smooth through the pins,
    about its parent where that is of its limb."""
    parent = int(PARENTS[joint])
    of_limb = CANONICAL[joint].split("_")[-1] in LIMB
    if of_limb:
        origin = _smooth(middle[:, parent])
    away = seen.tracks[:, :, joint] - origin[:, None]
    away[lasts] = np.nan
    usual = Habit(axes, np.zeros_like(place))
    if of_limb:
        usual = habit(middle, median_of(away[:, :, None])[:, 0], pinned, joint, axes)
    local = np.einsum("tba,tcb->tca", usual.axes, away) - usual.path_m[:, None]
    pin = np.einsum("tba,tb->ta", usual.axes, place - origin) - usual.path_m
    found = spread(local, pinned, pin, seen.noise[:, :, joint])
    away = np.einsum("tab,tb->ta", usual.axes, found.path_m + usual.path_m)
    if of_limb and performer is not None:
        length = performer.bones_m()[CANONICAL[joint]]
        off = np.linalg.norm((place - origin)[pinned], axis=1).mean() / length  # the pin's own share
        away *= (
            length * np.clip(off, *BONE_SHARE) / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
        )
    return away + origin


def _smooth(path: Array) -> Array:
    return gaussian_filter1d(path, PARENT_FRAMES, axis=0, mode="nearest")


def _pinned(seen: Around, pins: Sequence[PinEdit], lifted_m: float) -> tuple[NDArray[np.bool_], Array]:
    """Instants with a pin, shape (count,), and its place before the cameras there, shape (count, 3)."""
    flags, place = np.zeros(len(seen.time_s), dtype=bool), np.zeros((len(seen.time_s), 3))
    for pin in pins:
        rows = seen.rows_of(pin.start_s, pin.end_s)
        flags[rows], place[rows] = True, np.array(pin.place_m) - [0.0, 0.0, lifted_m]
    return flags, place


def _unseen_about(seen: Around, joint: int, pinned: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Instants around a pin in which no camera sees the joint, shape (count,)."""
    unseen = ~np.logical_or.reduce(np.isfinite(seen.tracks[:, :, joint, 0]), axis=1)
    out = np.zeros_like(unseen)
    for at in np.flatnonzero(pinned):
        first, last = run_about(unseen, int(at), 1)
        out[first:last] = unseen[first:last]
    return out


def run_about(flags: NDArray[np.bool_], at: int, gap: int) -> tuple[int, int]:
    """Return the first, and one past the last, of the true flags around a place; shorter gaps than `gap` count."""
    first = last = at
    while first > 0 and flags[max(first - gap, 0) : first].any():
        first -= 1
    while last < len(flags) and flags[last : last + gap].any():
        last += 1
    return first, last

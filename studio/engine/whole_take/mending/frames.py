"""The cameras' frames after edits: doubted joints left out or exchanged, and errors proved by pins mended."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.base.arrays import runs
from studio.engine.edits.edit import Edit, PinEdit
from studio.engine.edits.frames import Frames, doubted
from studio.engine.edits.timing import of_kind
from studio.engine.model.calibration import Calibration
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR, PARENTS
from studio.engine.whole_take.mending.around import Around
from studio.engine.whole_take.mending.changed import changed_frames
from studio.engine.whole_take.mending.evidence import Erring
from studio.engine.whole_take.mending.habit import Habit, habit
from studio.engine.whole_take.mending.interval import erring, fading, likelier, limb_of
from studio.engine.whole_take.mending.middle import median_of
from studio.engine.whole_take.mending.names import alike, by_names, exchanges, turned_back, turned_since
from studio.engine.whole_take.mending.pinned import REACH_S, PinnedJoint, pinned
from studio.engine.whole_take.mending.shifts import shift_of
from studio.engine.whole_take.mending.spread import spread
from studio.engine.whole_take.mending.told import PinFinding, told_of, told_of_unseen

Array = NDArray[np.float64]

WRONG_M = 0.06
"""Distance from a pin beyond which a camera contradicts it [m]."""

ALIKE_M = 0.15
"""A camera that saw nothing at the pin errs like the others where its joint is this near to theirs [m]."""

PARENT_FRAMES = 1.0
"""Smoothing of a parent's path, relative to which its child's is found [instants]."""

BONE_SHARE = (0.8, 1.2)
"""Range of a bone's length to a pin, as a share of its measured length."""

LIMB = ("elbow", "wrist", "hand", "knee", "ankle", "toe")
"""Joints whose parent belongs to their limb."""


def edited_frames(
    frames: Frames,
    calibration: Calibration,
    edits: Sequence[Edit],
    *,
    lifted_m: float = 0.0,
    tell: Callable[[PinFinding], None] = lambda found: None,
) -> Frames:
    """Return a performer's frames after edits; without edits of frames the same object.

    Args:
        frames: by camera, in order of time, of one performer.
        calibration: cameras, clocks and the performer's proportions.
        edits: of this performer.
        lifted_m: lift of the performer above the cameras' joints by the solve [m]; pins are on its floor.
        tell: receives each error that pins found.
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
    about = pinned(frames, calibration, pins, lifted_m)
    if about is None:
        return frames
    wrong = _Wrong(about)
    for at in (slice(*run) for run in runs(about.flags)):
        errs = _contradict(about, at)
        if errs.any():
            tell(wrong.add(at, errs))
    unseen = about.unseen()
    for run in runs(unseen):
        tell(told_of_unseen(about.seen, pins, about.joint, slice(*run)))
    guessed = wrong.guess(unseen)
    return changed_frames(frames, calibration, about.seen, wrong.places, wrong.gone, guessed)


class _Wrong:
    """Errors of the cameras around pins.

    Attributes:
        places: corrected places of joints [m], shape (count, camera_count, 21, 3); NaN = as measured.
        gone: joints that are left out, shape (count, camera_count, 21).
        lasts: where the joint is unknown, shape (count, camera_count).
    """

    def __init__(self, about: PinnedJoint) -> None:
        self._about = about
        shape = about.seen.tracks.shape[:3]
        self.places, self.gone = np.full((*shape, 3), np.nan), np.zeros(shape, dtype=bool)
        self.lasts = np.zeros(shape[:2], dtype=bool)

    def add(self, at: slice, errs: NDArray[np.bool_]) -> PinFinding:
        """Add the error that a pin proves of the cameras that contradict it; return the finding.

        Args:
            at: instants with the pin.
            errs: the cameras that contradict it, shape (camera_count,).
        """
        about, share = self._about, None
        found, named, turned = _likeliest(about, at, errs)
        if not found.is_seen:
            found, share = fading(about.seen.tracks[:, errs], about.joint, at, about.place_m)
        of_all = _in_all_cameras(named, about.joint, errs, turned, found)
        put, left = np.full_like(self.places, np.nan), np.zeros_like(self.gone)
        if found.follows:
            self._shift_back(put, found, share, named, of_all)
        else:
            self._leave_out(left, found, of_all, turned[found.rows])
        if share is None:
            _leave_out_ends(left, found, of_all, at)
        put, left = turned_back(put, turned), turned_back(left, turned)
        self._leave_out_between(left, found, exchanges(turned)[found.rows] & of_all)
        self.places, self.gone = np.where(np.isfinite(put), put, self.places), self.gone | left
        return told_of(about.seen, about.pins, at, found, of_all, turned, fades=share is not None)

    def _shift_back(
        self, put: Array, found: Erring, share: Array | None, named: Around, of_all: NDArray[np.bool_]
    ) -> None:
        """Undo the shift of joints by an error, in place."""
        axes = self._about.axes
        own = axes if found.in_body else np.broadcast_to(np.eye(3), axes.shape)
        if share is None:
            shift = shift_of(found, named.tracks, named.noise, of_all, own, self._about.performer)
            shifts = np.broadcast_to(shift, (len(of_all), 3))
        else:
            shifts = share[:, None] * found.shift_m
        shifted = np.einsum("tab,tb->ta", own[found.rows], shifts)[:, None]
        for other in found.joints:
            moved = named.tracks[found.rows, :, other] - shifted
            put[found.rows, :, other] = np.where(of_all[..., None], moved, np.nan)

    def _leave_out(
        self,
        left: NDArray[np.bool_],
        found: Erring,
        of_all: NDArray[np.bool_],
        turned: NDArray[np.bool_],
    ) -> None:
        """Leave out unknown joints, in place.

        `turned`: where cameras' names are those of the other side, at the error's instants.
        """
        self.lasts[found.rows] |= of_all & ~turned
        left[found.rows, :, self._about.joint] |= of_all & turned
        for other in found.joints[1:]:
            left[found.rows, :, other] |= of_all

    def _leave_out_between(self, left: NDArray[np.bool_], found: Erring, between: NDArray[np.bool_]) -> None:
        """Leave out joints that may be of either side while a camera exchanges left and right, in place.

        `between`: where it does so, at the error's instants, shape (row_count, camera_count).
        """
        for other in found.joints:
            left[found.rows, :, MIRROR[other]] |= between
            if found.follows or other != self._about.joint:
                left[found.rows, :, other] |= between
        if not found.follows:
            self.lasts[found.rows] |= between

    def guess(self, unseen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Put the joint, and those that it carries, on a path through the pins where it is unknown; return where, in
        the shape of `gone`.

        `unseen`: instants at which no camera sees it.
        """
        about, guessed = self._about, np.zeros_like(self.gone)
        if not self.lasts.any() and not unseen.any():
            return guessed
        middle = about.middle.copy()
        for joint in limb_of(about.joint)[0]:
            put = self.lasts & np.isfinite(about.seen.tracks[:, :, joint, 0])
            if joint == about.joint:
                put |= unseen[:, None]
            if not put.any():
                continue  # no camera has this joint
            path, rows = _path(about, middle, joint, self.lasts), put.any(axis=1)
            middle[rows, joint] = path[rows]
            self.places[:, :, joint] = np.where(put[..., None], path[:, None], self.places[:, :, joint])
            self.gone[:, :, joint] &= ~put
            guessed[:, :, joint] = put
        return guessed


def _contradict(about: PinnedJoint, at: slice) -> NDArray[np.bool_]:
    """The cameras whose joint contradicts the pin at some instant, shape (camera_count,)."""
    off = np.linalg.norm(about.seen.tracks[at, :, about.joint] - about.place_m[at][:, None], axis=2)
    return np.fmax.reduce(off, axis=0, initial=0.0) > WRONG_M


def _likeliest(
    about: PinnedJoint, at: slice, errs: NDArray[np.bool_]
) -> tuple[Erring, Around, NDArray[np.bool_]]:
    """The likeliest error of the cameras that contradict a pin, the cameras with the names that the error follows,
    and where these are those of the other side, shape (count, camera_count)."""
    seen, turned = about.seen, turned_since(about.seen, at, errs)

    def found_in(tracks: Array, noise: Array, told: NDArray[np.bool_] | None = None) -> Erring:
        return erring(
            tracks[:, errs], noise[:, errs], about.joint, at, about.place_m, about.axes, about.performer, told
        )

    found = found_in(seen.tracks, seen.noise)
    if turned.any():
        named, here = (
            by_names(seen, turned),
            np.where(exchanges(turned)[..., None, None], np.nan, seen.tracks),
        )
        told = ~turned[:, errs]  # so that both are judged by the same readings
        own, other = (found_in(*one, told) for one in ((here, seen.noise), (named.tracks, named.noise)))
        if other.is_seen and likelier(other, own) and turned[other.rows].any():
            return other, named, turned
    return found, seen, np.zeros_like(seen.exchanged)


def _in_all_cameras(
    seen: Around, joint: int, errs: NDArray[np.bool_], turned: NDArray[np.bool_], found: Erring
) -> NDArray[np.bool_]:
    """Where cameras err: those that contradict the pin, and those that mostly agree with them, shape (row_count,
    camera_count)."""
    near = 0.5 * float(np.linalg.norm(found.shift_m)) if found.follows else ALIKE_M
    same, mostly = alike(seen.tracks[found.rows, :, joint], errs, turned[found.rows], near)
    return errs | mostly & (found.follows | same)


def _leave_out_ends(gone: NDArray[np.bool_], found: Erring, errs: NDArray[np.bool_], at: slice) -> None:
    """Leave out joints that may be on either side of the jump where an error begins or ends, in place; not at the
    pin, nor those that are put on a path."""
    first, stop = found.rows.start, found.rows.stop
    inside = 1 if found.follows else 0
    for rows, by in ((range(first - 1, first + inside), errs[0]), (range(stop - inside, stop + 1), errs[-1])):
        for row in rows:
            if 0 <= row < len(gone) and not at.start <= row < at.stop:
                gone[row, :, list(found.joints)] |= by


def _path(about: PinnedJoint, middle: Array, joint: int, lasts: NDArray[np.bool_]) -> Array:
    """The path of a joint that is unknown while cameras err, shape (count, 3) [m]: smooth, through its pins, and
    relative to its parent where that belongs to its limb.

    Args:
        about: pins of the joint, or of one that carries it.
        middle: all joints [m], shape (count, 21, 3).
        joint: index of the joint.
        lasts: where cameras err, shape (count, camera_count).
    """
    seen, axes, origin = about.seen, about.axes, about.origin_m
    flags = about.flags if joint == about.joint else np.zeros_like(about.flags)
    of_limb = CANONICAL[joint].split("_")[-1] in LIMB
    if of_limb:
        origin = _smooth(middle[:, int(PARENTS[joint])])
    away, pin_away = seen.tracks[:, :, joint] - origin[:, None], about.place_m - origin
    away[lasts] = np.nan
    usual = Habit(axes, np.zeros_like(origin))
    if of_limb:
        known = median_of(away[:, :, None])[:, 0]
        usual = habit(middle, known, flags, pin_away, joint, axes)
    local = np.einsum("tba,tcb->tca", usual.axes, away) - usual.path_m[:, None]
    pin = np.einsum("tba,tb->ta", usual.axes, pin_away) - usual.path_m
    found = spread(local, flags, pin, seen.noise[:, :, joint])
    away = np.einsum("tab,tb->ta", usual.axes, found.path_m + usual.path_m)
    if of_limb and about.performer is not None:
        length = about.performer.bones_m()[CANONICAL[joint]]
        off = (
            np.linalg.norm(pin_away[flags], axis=1).mean() / length if flags.any() else 1.0
        )  # the pin's own share
        away *= (
            length * np.clip(off, *BONE_SHARE) / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
        )
    return away + origin


def _smooth(path: Array) -> Array:
    return gaussian_filter1d(path, PARENT_FRAMES, axis=0, mode="nearest")

"""The cameras' frames as edits leave them: doubted ones, and those that a pin proves wrong, mended around it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.calibration.cameras.noise import rays
from studio.engine.edits.edit import Edit, PinEdit
from studio.engine.edits.frames import Changed, Frames, doubted
from studio.engine.edits.timing import of_kind
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR, PARENTS
from studio.engine.whole_take.mending.around import GAP_S, STEP_S, Around, around, axes_of
from studio.engine.whole_take.mending.spread import Spread, spread

Array = NDArray[np.float64]

REACH_S = 2.5
"""How far from a pin an error may last [s]."""

WRONG_M = 0.06
"""Smallest error of a camera that is taken to last [m]."""

WRONG_SHARE = 0.35
"""An error lasts as long as it has this share of what it is at the pin."""

WILD = 2.5
"""An error that many times as large as at the pin is another one."""

ALIKE = 0.5
"""A camera errs like others if it is off by this share of their error along it."""

LENGTH_M = 0.06
"""A bone that differs by more from its length has a wrong end [m]."""

PARENT_FRAMES = 1.0
"""Smoothing of a joint's path about which its child's is found [instants]."""

BONE_SHARE = (0.8, 1.2)
"""A bone to a pin has this share of its length."""

LIMB = ("elbow", "wrist", "hand", "knee", "ankle", "toe")
SOUND_FRAMES, OFF_M = 1.0, 0.08
"""Joints whose bone is measured; smoothing of its length [instants], and how far off it fits no more [m]."""

AS_SOUND = 0.2
"""A joint that fits its limb at a pin that it contradicts tells little by fitting elsewhere, by this much."""

DOUBTED = 8.0
"""Factor of the noise of a joint that errs while its parent does not."""

EDGE_FRAMES, SHARED = 3, 0.5
"""A neighbour has the same error if it jumps by this share of it between the means of so many instants."""

FILLED_CONFIDENCE = 0.4
"""Confidence of a joint that no camera saw, put where the pins make it most likely."""


def edited_frames(frames: Frames, calibration: Calibration, edits: Sequence[Edit]) -> Frames:
    """Return a performer's frames as edits leave them; without edits of frames the same object.

    Args:
        frames: by camera, in order of time, of one performer.
        calibration: cameras, clocks and the performer's proportions.
        edits: of this performer.
    """
    frames = doubted(frames, calibration, edits)
    for pins in _together([pin for pin in of_kind(edits, PinEdit) if pin.joint in INDEX]):
        frames = _mended(frames, calibration, pins)
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


def _mended(frames: Frames, calibration: Calibration, pins: Sequence[PinEdit]) -> Frames:
    """Return frames mended around some pins of one joint."""
    begin = min(pin.start_s for pin in pins) - REACH_S
    end = max(pin.end_s for pin in pins) + REACH_S
    seen = around(frames, calibration, begin, end)
    if seen is None:
        return frames
    joint = INDEX[pins[0].joint]
    pinned, place = _pinned(seen, pins)
    middle = seen.middle()
    axes, origin = axes_of(middle, joint)
    if calibration.performer is not None:
        out = place - origin
        far = np.linalg.norm(out, axis=1, keepdims=True) / calibration.performer.reach_m()[joint]
        place = origin + out / np.maximum(far, 1.0)
    sound = _sound(seen, joint, calibration.performer, pinned)

    def in_axes(axes: Array) -> tuple[Array, Array, Spread]:
        local = np.einsum("tba,tcb->tca", axes, seen.tracks[:, :, joint] - origin[:, None])
        pin = np.einsum("tba,tb->ta", axes, place - origin)
        return axes, local, spread(local, pinned, pin, seen.noise[:, :, joint], sound)

    # An error may last in the body's axes or in the stage's: whichever explains more.
    candidates = [in_axes(axes), in_axes(np.tile(np.eye(3), (len(axes), 1, 1)))]
    axes, local, found = min(candidates, key=lambda one: one[2].cost)
    lasts = _in_all_cameras(_lasting(found.error_m, pinned), found.error_m, local - found.path_m[:, None])
    error = np.einsum("tab,tcb->tca", axes, found.error_m * lasts[..., None])
    too = [other for other in _beside(joint) if _errs_too(seen, other, error, lasts, axes, origin)]
    parent = int(PARENTS[joint])
    if parent in too or parent not in _beside(joint):
        path = np.einsum("tab,tb->ta", axes, found.path_m) + origin
    else:
        path = _about_parent(seen, joint, middle, axes, lasts, pinned, place, sound, calibration.performer)
    places = np.full((*seen.tracks.shape[:3], 3), np.nan)
    known = np.isfinite(seen.tracks[:, :, joint, 0])
    places[:, :, joint] = np.where((lasts & known)[..., None], path[:, None], np.nan)
    gone = np.zeros(places.shape[:3], dtype=bool)
    for other in too:
        _mend_too(seen, joint, other, error, lasts, calibration, places, gone)
    unseen = _unseen_about(seen, joint, pinned)
    places[:, :, joint] = np.where(unseen[:, None, None], path[:, None], places[:, :, joint])
    return _changed(frames, calibration, seen, places, gone)


def _sound(seen: Around, joint: int, performer: Performer | None, pinned: NDArray[np.bool_]) -> Array:
    """How much better each camera's joint fits its limb than at the pins, 0..1, shape (count, camera_count): bones
    up to the trunk have their lengths."""
    worst = np.zeros(seen.tracks.shape[:2])
    bones = {} if performer is None else performer.bones_m()
    while performer is not None and CANONICAL[joint].split("_")[-1] in LIMB:
        parent = int(PARENTS[joint])
        apart = np.linalg.norm(seen.tracks[:, :, joint] - seen.tracks[:, :, parent], axis=2)
        worst = np.fmax(worst, np.abs(apart - bones[CANONICAL[joint]]))
        joint = parent
    sound = 1.0 - np.clip(gaussian_filter1d(worst, SOUND_FRAMES, axis=0, mode="nearest") / OFF_M, 0.0, 1.0)
    at_pins = sound[pinned].mean(axis=0)
    return np.clip((sound - at_pins) / (1.0 - at_pins + AS_SOUND), 0.0, 1.0)


def _about_parent(
    seen: Around,
    joint: int,
    middle: Array,
    axes: Array,
    lasts: NDArray[np.bool_],
    pinned: NDArray[np.bool_],
    place: Array,
    sound: Array,
    performer: Performer | None,
) -> Array:
    """The path of a joint whose parent does not err, shape (count, 3) [m]: what cameras say of it while they err
    hardly counts, since an error that does not move the parent is no mere shift."""
    origin = gaussian_filter1d(middle[:, PARENTS[joint]], PARENT_FRAMES, axis=0, mode="nearest")
    local = np.einsum("tba,tcb->tca", axes, seen.tracks[:, :, joint] - origin[:, None])
    noise = np.where(lasts, DOUBTED, 1.0) * seen.noise[:, :, joint]
    found = spread(local, pinned, np.einsum("tba,tb->ta", axes, place - origin), noise, sound)
    away = np.einsum("tab,tb->ta", axes, found.path_m)
    if performer is not None:
        length = performer.bones_m()[CANONICAL[joint]]
        off = np.linalg.norm((place - origin)[pinned], axis=1).mean() / length  # the pin's own share
        away *= (
            length * np.clip(off, *BONE_SHARE) / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
        )
    return away + origin


def _pinned(seen: Around, pins: Sequence[PinEdit]) -> tuple[NDArray[np.bool_], Array]:
    """Instants with a pin, shape (count,), and its place there, shape (count, 3)."""
    flags, place = np.zeros(len(seen.time_s), dtype=bool), np.zeros((len(seen.time_s), 3))
    for pin in pins:
        rows = slice(seen.row_of(pin.start_s), seen.row_of(pin.end_s) + 1)
        flags[rows], place[rows] = True, pin.place_m
    return flags, place


def _lasting(error: Array, pinned: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Instants up to which each camera's error at a pin lasts, shape (count, camera_count)."""
    out = np.zeros(error.shape[:2], dtype=bool)
    size = np.linalg.norm(error, axis=2)
    gap = round(GAP_S / STEP_S)
    for at in np.flatnonzero(pinned):
        here = size[max(at - 2, 0) : at + 3].max(axis=0)
        for camera in np.flatnonzero(here > WRONG_M):
            wrong = size[:, camera] > max(WRONG_SHARE * here[camera], WRONG_M)
            wrong &= size[:, camera] < WILD * here[camera]
            first, last = run_about(wrong, int(at), gap)
            out[first:last, camera] = True
    return out


def _in_all_cameras(lasts: NDArray[np.bool_], error: Array, off: Array) -> NDArray[np.bool_]:
    """Errors that last, also in cameras that saw nothing at the pin but are off like the others, shape (count,
    camera_count).

    Args:
        lasts: those of the cameras that contradict the pin.
        error: shape (count, camera_count, 3) [m].
        off: of each camera's joint from the path [m], same shape; NaN = unseen.
    """
    among = np.maximum(lasts.sum(axis=1, keepdims=True), 1)
    common = np.where(lasts[..., None], error, 0.0).sum(axis=1) / among
    size = np.linalg.norm(common, axis=1)[:, None]
    along = np.einsum("tca,ta->tc", np.nan_to_num(off), common)
    return lasts | (size > WRONG_M) & (along > ALIKE * size**2)


def _beside(joint: int) -> list[int]:
    """The limb's joints beside one that may err with it."""
    side, _, part = CANONICAL[joint].partition("_")
    parts = {"wrist": ("hand", "elbow"), "ankle": ("toe", "knee"), "elbow": ("wrist", "hand"),
             "knee": ("ankle", "toe"), "hand": ("wrist",), "toe": ("ankle",)}.get(part, ())  # fmt: skip
    return [INDEX[f"{side}_{other}"] for other in parts]


def _errs_too(
    seen: Around, other: int, error: Array, lasts: NDArray[np.bool_], axes: Array, origin: Array
) -> bool:
    """Whether a neighbour errs with a joint: it jumps as far where the error begins and ends."""
    local = np.einsum("tba,tcb->tca", axes, seen.tracks[:, :, other] - origin[:, None])
    own = np.einsum("tba,tcb->tca", axes, error)
    shares = []
    for camera in range(lasts.shape[1]):
        edges = np.flatnonzero(np.diff(lasts[:, camera].astype(int)))
        for edge in edges[(edges >= EDGE_FRAMES) & (edges < len(lasts) - EDGE_FRAMES - 1)]:
            inside = edge + 1 if lasts[edge + 1, camera] else edge
            expected = own[inside, camera] * (1.0 if inside > edge else -1.0)
            size = np.linalg.norm(expected)
            if size < WRONG_M:
                continue
            before = local[edge - EDGE_FRAMES + 1 : edge + 1, camera]
            after = local[edge + 1 : edge + 1 + EDGE_FRAMES, camera]
            jump = np.nanmean(after, axis=0) - np.nanmean(before, axis=0) if _seen_in(before, after) else None
            if jump is not None:
                shares.append(float(jump @ expected) / size**2)
    return bool(shares) and float(np.median(shares)) > SHARED


def _seen_in(*parts: Array) -> bool:
    return all(np.isfinite(part[:, 0]).any() for part in parts)


def _mend_too(
    seen: Around,
    joint: int,
    other: int,
    error: Array,
    lasts: NDArray[np.bool_],
    calibration: Calibration,
    places: Array,
    gone: NDArray[np.bool_],
) -> None:
    """Put a neighbour where it is without the joint's error, if its bone has its length then; else leave it out."""
    moved = seen.tracks[:, :, other] - error
    nearer = joint if PARENTS[other] == joint or PARENTS[joint] == other else _beside(joint)[0]
    child = other if PARENTS[other] == nearer else nearer
    apart = np.linalg.norm(moved - places[:, :, nearer], axis=2)[lasts]
    fits = False
    if calibration.performer is not None and np.isfinite(apart).any():
        length = calibration.performer.bones_m()[CANONICAL[child]]
        fits = abs(float(np.nanmedian(apart)) - length) < LENGTH_M
    if fits:
        places[:, :, other] = np.where(lasts[..., None], moved, places[:, :, other])
    else:
        gone[:, :, other] |= lasts


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


def _changed(
    frames: Frames, calibration: Calibration, seen: Around, places: Array, gone: NDArray[np.bool_]
) -> Frames:
    """Return the frames with joints put elsewhere or left out.

    Args:
        places: new places, stage frame [m], shape (count, camera_count, 21, 3); NaN = as it is.
        gone: joints that are left out, shape (count, camera_count, 21).
    """
    out = dict(frames)
    for k, (name, mine) in enumerate(seen.cameras.items()):
        camera = calibration.cameras[name]
        T, changed = camera.T_stage_camera, dict[int, CameraFrame]()
        rows = np.clip(np.rint((mine.time_s - seen.time_s[0]) / STEP_S).astype(int), 0, len(places) - 1)
        for n, (row, place) in enumerate(zip(rows.tolist(), mine.places, strict=True)):
            put, left = np.isfinite(places[row, k, :, 0]), gone[row, k]
            if not put.any() and not left.any():
                continue
            own = _at(places[:, k], seen.time_s, mine.time_s[n], row)
            order = MIRROR if seen.exchanged[row, k] else slice(None)
            own, put, left = own[order], put[order], left[order]
            frame = frames[name][place]
            local = (own - T[:3, 3]) @ T[:3, :3]
            local -= camera.depth_bias_m * rays(local)
            positions = np.where(put[:, None], local, frame.positions)
            confidence = np.where(put, np.maximum(frame.confidence, FILLED_CONFIDENCE), frame.confidence)
            positions[left], confidence[left] = np.nan, 0.0
            changed[place] = replace(frame, positions=positions, confidence=confidence)
        if changed:
            out[name] = Changed(frames[name], changed)
    return out


def _at(places: Array, grid_s: Array, time_s: float, row: int) -> Array:
    """Places, shape (count, 21, 3), at a time near an instant: between it and the next where both are known."""
    other = int(np.clip(row + (1 if time_s > grid_s[row] else -1), 0, len(places) - 1))
    share = abs(time_s - grid_s[row]) / STEP_S
    between = (1.0 - share) * places[row] + share * places[other]
    return np.where(np.isfinite(between), between, places[row])

"""The cameras' frames as edits leave them: doubted ones, and those that a pin proves wrong, mended around it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from studio.engine.base.geometry import transform_points
from studio.engine.edits.edit import Edit, PinEdit
from studio.engine.edits.frames import Changed, Frames, doubted, places_between, stage_s
from studio.engine.edits.spread import STEP_S, spread
from studio.engine.edits.timing import of_kind
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT, PARENT_OF_CANONICAL

Array = NDArray[np.float64]

REACH_S = 2.5
"""How far from a pin an error may last [s]."""

WRONG_M = 0.06
"""Smallest error of a camera that is taken to last; smaller ones ease out with the pin [m]."""

WRONG_SHARE = 0.3
"""An error lasts as long as it has this share of what it is at the pin."""

GAP_S = 0.1
"""Longest gap between two frames that is interpolated, and in an error."""

LENGTH_M = 0.06
"""A bone that differs by more from its length has a wrong end [m]."""

FILLED_CONFIDENCE = 0.4
"""Confidence of a joint that no camera saw, put where the pins make it most likely."""

_TRUNK = [INDEX[name] for name in ("hips", "spine", "chest", "neck", "left_shoulder", "right_shoulder")]
_HIPS = [INDEX[name] for name in ("hips", "left_hip", "right_hip")]


def edited_frames(frames: Frames, calibration: Calibration, edits: Sequence[Edit]) -> Frames:
    """Return a performer's frames as edits leave them; without edits of frames the same object.

    Args:
        frames: by camera, in order of time, of one performer.
        calibration: cameras, clocks and the performer's proportions.
        edits: of this performer.
    """
    frames = doubted(frames, calibration, edits)
    pins = [pin for pin in of_kind(edits, PinEdit) if pin.joint in INDEX]
    for group in _together(pins):
        frames = _Around(frames, calibration, group).mended()
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


@dataclass(frozen=True)
class _Seen:
    """One camera's joints around a pin: indices and times of its frames, joints in the stage frame."""

    places: range
    time_s: Array
    positions: Array
    confidence: Array


class _Around:
    """The frames around some pins of one joint."""

    def __init__(self, frames: Frames, calibration: Calibration, pins: Sequence[PinEdit]) -> None:
        self._frames, self._calibration, self._pins = frames, calibration, pins
        self._joint = INDEX[pins[0].joint]
        begin = min(pin.start_s for pin in pins) - REACH_S
        end = max(pin.end_s for pin in pins) + REACH_S
        count = round((end - begin) / STEP_S) + 1
        self._time_s = begin + STEP_S * np.arange(count)
        self._seen = {
            name: found
            for name, mine in frames.items()
            if name in calibration.cameras and (found := self._of_camera(name, mine)) is not None
        }
        self._grid = {name: self._on_grid(seen) for name, seen in self._seen.items()}

    def _of_camera(self, name: str, frames: Sequence[CameraFrame]) -> _Seen | None:
        """A camera's joints around the pins; None for one without depth, or without frames there."""
        time_of = stage_s(self._calibration, name)
        places = places_between(frames, time_of, float(self._time_s[0]), float(self._time_s[-1]))
        found = [frames[place] for place in places]
        if not found or any(frame.picture is not None for frame in found):
            return None
        T = self._calibration.cameras[name].T_stage_camera
        positions = transform_points(T, np.array([frame.positions for frame in found]))
        confidence = np.array([frame.confidence for frame in found])
        return _Seen(places, np.array([time_of(frame) for frame in found]), positions, confidence)

    def _on_grid(self, seen: _Seen) -> Array:
        """A camera's joints at the instants, shape (count, 21, 3); NaN where it sees none."""
        out = np.full((len(self._time_s), JOINT_COUNT, 3), np.nan)
        for joint in range(JOINT_COUNT):
            known = np.isfinite(seen.positions[:, joint, 0])
            if known.sum() < 2:
                continue
            times = seen.time_s[known]
            after = np.clip(np.searchsorted(times, self._time_s), 1, len(times) - 1)
            near = (times[after] - times[after - 1] < GAP_S) & (self._time_s <= times[-1] + 0.5 * STEP_S)
            near &= self._time_s >= times[0] - 0.5 * STEP_S
            for axis in range(3):
                own = np.interp(self._time_s, times, seen.positions[known, joint, axis])
                out[near, joint, axis] = own[near]
        return out

    def mended(self) -> Frames:
        """Return all frames, those that the pins prove wrong mended."""
        if not self._grid:
            return self._frames
        tracks = np.stack([*self._grid.values()], axis=1)  # (count, camera, 21, 3)
        axes, origin = self._axes(tracks)
        local = np.einsum("tba,tcb->tca", axes, tracks[:, :, self._joint] - origin[:, None])
        pinned, place = self._pinned()
        own_place = np.einsum("tba,tb->ta", axes, place - origin)
        found = spread(local, pinned, own_place)
        error = np.einsum("tab,tcb->tca", axes, self._lasting(found.error_m, pinned))
        path = np.einsum("tab,tb->ta", axes, found.path_m) + origin
        return self._changed(tracks, error, path, pinned)

    def _pinned(self) -> tuple[NDArray[np.bool_], Array]:
        """Instants with a pin, and its place there."""
        flags, place = np.zeros(len(self._time_s), dtype=bool), np.zeros((len(self._time_s), 3))
        for pin in self._pins:
            first = round((pin.start_s - self._time_s[0]) / STEP_S)
            last = round((pin.end_s - self._time_s[0]) / STEP_S)
            flags[first : last + 1], place[first : last + 1] = True, pin.place_m
        return flags, place

    def _axes(self, tracks: Array) -> tuple[Array, Array]:
        """Axes of the trunk, shape (count, 3, 3), and the place of the limb's root, shape (count, 3), smoothed."""
        with np.errstate(all="ignore"):
            middle = _filled(np.nanmedian(tracks, axis=1))
        root = self._joint
        while (
            CANONICAL[root].split("_")[-1] not in ("shoulder", "hip")
            and CANONICAL[root] in PARENT_OF_CANONICAL
        ):
            root = INDEX[PARENT_OF_CANONICAL[CANONICAL[root]]]
        if root == self._joint or "_" not in CANONICAL[self._joint]:
            origin = (
                middle[:, _TRUNK].mean(axis=1) if CANONICAL[self._joint] != "hips" else middle[:, root] * 0.0
            )
            return np.tile(np.eye(3), (len(middle), 1, 1)), origin
        side = "hip" if root in _HIPS else "shoulder"
        smooth = gaussian_filter1d(middle, 0.1 / STEP_S, axis=0, mode="nearest")
        x = smooth[:, INDEX[f"left_{side}"]] - smooth[:, INDEX[f"right_{side}"]]
        up = smooth[:, INDEX["neck"]] - smooth[:, INDEX["hips"]]
        x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-6)
        y = np.cross(up, x)
        y /= np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-6)
        return np.stack([x, y, np.cross(x, y)], axis=2), smooth[:, root]

    def _lasting(self, error: Array, pinned: NDArray[np.bool_]) -> Array:
        """Each camera's errors as far as they last around a pin, 0 elsewhere; small ones ease out with it."""
        out = np.zeros_like(error)
        gap = round(GAP_S / STEP_S)
        for camera in range(error.shape[1]):
            size = np.linalg.norm(error[:, camera], axis=1)
            for at in np.flatnonzero(pinned):
                here = size[max(at - 2, 0) : at + 3].max()
                if here < WRONG_M:
                    continue
                wrong = size > max(WRONG_SHARE * here, 0.5 * WRONG_M)
                first, last = _run(wrong, int(at), gap)
                out[first:last, camera] = error[first:last, camera]
        return out

    def _changed(self, tracks: Array, error: Array, path: Array, pinned: NDArray[np.bool_]) -> Frames:
        out = dict(self._frames)
        unseen = ~np.isfinite(tracks[:, :, self._joint, 0]).any(axis=1)
        filled = np.zeros(len(unseen), dtype=bool)
        for at in np.flatnonzero(pinned):
            first, last = _run(unseen, int(at), 1)
            filled[first:last] = unseen[first:last]
        for k, (name, seen) in enumerate(self._seen.items()):
            T = self._calibration.cameras[name].T_stage_camera
            changed: dict[int, CameraFrame] = {}
            rows = np.clip(np.rint((seen.time_s - self._time_s[0]) / STEP_S).astype(int), 0, len(error) - 1)
            for row, place in zip(rows.tolist(), seen.places, strict=True):
                wrong = error[row, k] @ T[:3, :3]  # the inverse rotation
                if not wrong.any() and not filled[row]:
                    continue
                frame = self._frames[name][place]
                positions, confidence = frame.positions.copy(), frame.confidence.copy()
                if wrong.any():
                    positions[self._joint] -= wrong
                elif np.isnan(positions[self._joint, 0]):
                    positions[self._joint] = (path[row] - T[:3, 3]) @ T[:3, :3]
                    confidence[self._joint] = FILLED_CONFIDENCE
                changed[place] = replace(frame, positions=positions, confidence=confidence)
            if changed:
                out[name] = Changed(self._frames[name], changed)
        return out


def _run(flags: NDArray[np.bool_], at: int, gap: int) -> tuple[int, int]:
    """First, and one past the last, of the flags that are true around a place, shorter gaps counted as true."""
    first = last = at
    while first > 0 and flags[max(first - gap, 0) : first].any():
        first -= 1
    while last < len(flags) and flags[last : last + gap].any():
        last += 1
    return first, last


def _filled(tracks: Array) -> Array:
    """Tracks with gaps filled in time, shape (count, joint_count, 3); a joint never seen is at the first's place."""
    out = tracks.copy()
    places = np.arange(len(out))
    for joint in range(out.shape[1]):
        known = np.isfinite(out[:, joint, 0])
        for axis in range(3):
            out[:, joint, axis] = (
                np.interp(places, places[known], out[known, joint, axis]) if known.any() else 0.0
            )
    return out

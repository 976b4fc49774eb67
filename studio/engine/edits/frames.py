"""Edits of cameras' joints: left out, or left and right exchanged, before anything is solved."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import Edit, ExchangeEdit, LeaveOutEdit
from studio.engine.edits.timing import of_kind
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR
from studio.engine.model.on_demand import FramesOnDemand

Frames = Mapping[str, Sequence[CameraFrame]]

TURNED_SHARE, TURNED_M = 0.5, 0.06
"""A camera exchanged left and right between two frames if the joints' median movement exceeds the second value, and
an exchange reduces it to less than the first, a share."""

LONGEST_S = 5.0
"""Longest time before and after an instant in which an edit of that instant exchanges a camera's sides [s]."""

_SIDED = MIRROR != np.arange(JOINT_COUNT)


class Changed(FramesOnDemand):
    """A camera's frames, some of them changed."""

    def __init__(self, frames: Sequence[CameraFrame], changed: Mapping[int, CameraFrame]) -> None:
        self._frames, self._changed = frames, changed

    def __len__(self) -> int:
        return len(self._frames)

    def at(self, index: int) -> CameraFrame:
        return self._changed[index] if index in self._changed else self._frames[index]

    def changed_from(self, frames: Sequence[CameraFrame]) -> set[int]:
        """Return the indices of frames that differ from the original ones."""
        below = self._frames
        earlier = below.changed_from(frames) if below is not frames and isinstance(below, Changed) else set()
        return earlier | set(self._changed)


def stage_s(calibration: Calibration, camera: str) -> Callable[[CameraFrame], float]:
    """Return the function that gives the stage time of a camera's frames [s]."""
    clock = calibration.cameras[camera].clock
    return lambda frame: clock.stage_ns(frame.device_time_ns) * 1e-9


def places_between(
    frames: Sequence[CameraFrame], time_of: Callable[[CameraFrame], float], begin_s: float, end_s: float
) -> range:
    """Return the indices of a camera's frames, in order of time, between two stage times [s]."""
    return range(bisect_left(frames, begin_s, key=time_of), bisect_right(frames, end_s, key=time_of))


def changed_spans_s(frames: Frames, edited: Frames, calibration: Calibration) -> list[tuple[float, float]]:
    """Return the times of frames that edits changed, as spans of zero length [s].

    Args:
        frames: by camera.
        edited: the same frames after edits.
        calibration: has the cameras' clocks.
    """
    return [
        (time_s, time_s)
        for name, mine in edited.items()
        if mine is not frames[name] and isinstance(mine, Changed) and name in calibration.cameras
        for place in mine.changed_from(frames[name])
        for time_s in [stage_s(calibration, name)(mine[place])]
    ]


def doubted(frames: Frames, calibration: Calibration, edits: Sequence[Edit]) -> Frames:
    """Return frames with sides exchanged and joints left out by edits; other cameras stay the same object.

    Args:
        frames: by camera, in order of time, of one performer.
        calibration: has the cameras' clocks.
        edits: of this performer; other kinds are ignored.
    """
    asked = [*of_kind(edits, ExchangeEdit), *of_kind(edits, LeaveOutEdit)]
    if not asked:
        return frames
    out = dict(frames)
    for name, mine in frames.items():
        if name not in calibration.cameras:
            continue
        time_of = stage_s(calibration, name)
        changed: dict[int, CameraFrame] = {}
        for edit in (one for one in asked if one.camera in (None, name)):
            joints = _joints(edit.joints, both=isinstance(edit, ExchangeEdit))
            if isinstance(edit, ExchangeEdit):
                places, change = _exchanged_places(edit, mine, time_of, joints), with_sides_exchanged
            else:
                wider = edit.ease_s if edit.start_s == edit.end_s else 0.0
                places = places_between(mine, time_of, edit.start_s - wider, edit.end_s + wider)
                change = without_joints
            for place in places:
                changed[place] = change(changed.get(place, mine[place]), joints)
        if changed:
            out[name] = Changed(mine, changed)
    return out


def _joints(names: Sequence[str], *, both: bool) -> NDArray[np.bool_]:
    """Flags of joints, shape (21,); none named = all. `both`: of either side."""
    if not names:
        return np.ones(JOINT_COUNT, dtype=bool)
    flags = np.zeros(JOINT_COUNT, dtype=bool)
    flags[[INDEX[name] for name in names if name in INDEX]] = True
    return flags | flags[MIRROR] if both else flags


def _exchanged_places(
    edit: ExchangeEdit,
    frames: Sequence[CameraFrame],
    time_of: Callable[[CameraFrame], float],
    joints: NDArray[np.bool_],
) -> range:
    """The frames that an exchange applies to; an instant stands for the time in which the camera kept its sides."""
    if edit.start_s < edit.end_s:
        return places_between(frames, time_of, edit.start_s, edit.end_s)
    around = places_between(frames, time_of, edit.start_s - LONGEST_S, edit.end_s + LONGEST_S)
    if not len(around):
        return around
    positions = np.array([_shown(frames[place]) for place in around])[:, joints & _SIDED]
    mirrored = np.array([_shown(frames[place])[MIRROR] for place in around])[:, joints & _SIDED]
    turns = _turns(positions, mirrored)
    at = min(bisect_left(frames, edit.start_s, key=time_of), around.stop - 1) - around.start
    before, after = turns[turns <= at], turns[turns > at]
    first = int(before[-1]) if len(before) else 0
    last = int(after[0]) if len(after) else len(around)
    return range(around.start + first, around.start + last)


def _shown(frame: CameraFrame) -> NDArray[np.float64]:
    """A frame's joints, shape (21, 3) [m]; those in a picture are scaled to a body height of 1.7 m."""
    if frame.picture is None:
        return frame.positions
    pixels = frame.picture.pixels
    height = max(float(np.nanmax(pixels[:, 1]) - np.nanmin(pixels[:, 1])), 1.0) if len(pixels) else 1.0
    return np.pad(pixels / height * 1.7, ((0, 0), (0, 1)))


def _turns(positions: NDArray[np.float64], mirrored: NDArray[np.float64]) -> NDArray[np.int64]:
    """Indices of frames before which the sides were exchanged. A frame without joints is skipped.

    Args:
        positions: sided joints in consecutive frames [m], shape (frame_count, joint_count, 3); NaN = unseen.
        mirrored: the same with the sides exchanged.
    """
    last, found = None, []
    for k in range(len(positions)):
        if np.isfinite(positions[k, :, 0]).sum() < 2:
            continue
        if last is not None:
            stays, turns = (
                np.linalg.norm(positions[k] - one, axis=1) for one in (positions[last], mirrored[last])
            )
            known = np.isfinite(stays) & np.isfinite(turns)
            if known.any():
                stay, turn = np.median(stays[known]), np.median(turns[known])
                if stay > TURNED_M and turn < TURNED_SHARE * stay:
                    found.append(k)
        last = k
    return np.array(found, dtype=np.int64)


def with_sides_exchanged(frame: CameraFrame, joints: NDArray[np.bool_]) -> CameraFrame:
    """Return a frame with left and right of some joints, shape (21,), exchanged."""
    order = np.where(joints, MIRROR, np.arange(JOINT_COUNT))
    picture = frame.picture
    if picture is not None:
        hands = None if picture.hands is None else picture.hands[::-1]
        picture = replace(picture, pixels=picture.pixels[order], world_m=picture.world_m[order], hands=hands)
    return replace(
        frame, positions=frame.positions[order], confidence=frame.confidence[order], picture=picture
    )


def without_joints(frame: CameraFrame, joints: NDArray[np.bool_]) -> CameraFrame:
    """Return a frame that does not show some joints, shape (21,)."""
    gone = joints[:, None]
    picture = frame.picture
    if picture is not None:
        picture = replace(
            picture,
            pixels=np.where(gone, np.nan, picture.pixels),
            world_m=np.where(gone, np.nan, picture.world_m),
            hands=None if joints.all() else picture.hands,
            face=None if joints.all() else picture.face,
        )
    return replace(
        frame,
        positions=np.where(gone, np.nan, frame.positions),
        confidence=np.where(joints, 0.0, frame.confidence),
        picture=picture,
        hands=() if joints.all() else frame.hands,
        head_wxyz=None if joints[INDEX["head"]] else frame.head_wxyz,
    )

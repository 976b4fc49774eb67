"""The depth images of a take as skeletons, for its solves by the `tracker` switch and for its calibration."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import blake2b
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.depth_floor import seen_floors
from studio.engine.calibration.drift import follow_clocks
from studio.engine.calibration.floor import Floor
from studio.engine.calibration.result import Calibration
from studio.engine.depth import DepthFrame
from studio.engine.errors import CalibrationError, SettingsError, TakeError
from studio.engine.frames import CameraFrame
from studio.engine.settings import SolveSettings
from studio.engine.tracker.camera_poses import MOST_SETS, refine_camera_poses
from studio.engine.tracker.skeletons import POINTS, from_points, per_camera, points_calibration
from studio.take.raw import camera_frames, inspect_raw
from studio.take.raw_depth import DepthRecording
from studio.take.take import Take
from studio.take.tracked import Tracked, keep_tracked, read_tracked

Progress = Callable[[float], None]
_CAMERA = "camera-"
_LEAST_WALK_S = 10.0
_FLOOR_IMAGES = 5
_SHARE = 0.9
"""Of the time that a solve from depth takes, tracking takes about this share."""


def is_tracked(take: Take, settings: SolveSettings) -> bool:
    """Whether solves with these settings get their skeletons from depth, not as they were received."""
    summary = inspect_raw(take.raw_path)
    return bool(summary.depth_frames) and not (settings.tracker == "client" and any(summary.frames.values()))


def tracked_frames(
    take: Take,
    calibration: Calibration,
    settings: SolveSettings,
    progress: Progress | None = None,
    *,
    only_kept: bool = False,
) -> tuple[Mapping[str, Sequence[CameraFrame]], Calibration, SolveSettings]:
    """Return skeletons by camera, the calibration that places them, and the settings to solve them with.

    `tracker=points` gives one camera, `points`, that stands for all; `per_camera` one skeleton stream for every
    camera with depth, also where `client` asks for the skeletons as received of a take that has none: it is tracked
    as clients would have done it. What was tracked is kept in the take.

    Raises:
        CalibrationError: none of the cameras has a transform. SettingsError: `cameras` names one that is not there.
        TakeError: with `only_kept`, where the take has yet to be tracked.
    """
    recording = DepthRecording(take.raw_path)
    placed = tuple(name for name in recording.cameras if name in calibration.cameras)
    if not placed:
        raise CalibrationError(
            f"the calibration of {take.path} has none of the cameras with depth ({', '.join(recording.cameras)}); "
            f"run `studio calibrate {take.path}`"
        )
    names = settings.camera_names(placed)
    if settings.tracker != "points":
        return _skeletons(take, recording, names, progress, only_kept=only_kept), calibration, settings
    tracked = _points(take, recording, calibration, names, progress, only_kept=only_kept)
    calibration = points_calibration(calibration, names, tracked.performer)
    return {POINTS: tracked.frames}, calibration, replace(settings, cameras="all")


def _skeletons(
    take: Take,
    recording: DepthRecording,
    names: tuple[str, ...],
    progress: Progress | None = None,
    *,
    only_kept: bool = False,
) -> Mapping[str, Sequence[CameraFrame]]:
    """Return each camera's own skeletons in order of time."""
    found = {name: read_tracked(take, _CAMERA + name) for name in names}
    missing = tuple(name for name, kept in found.items() if kept is None)
    if missing:
        _check_may_track(take, only_kept)
        frames: dict[str, list[CameraFrame]] = {name: [] for name in missing}
        images = _told(recording, recording.frames(missing), missing, progress)
        for frame in per_camera(images, {name: recording.cameras[name] for name in missing}):
            frames[frame.camera].append(frame)
        for name in missing:
            found[name] = Tracked(frames[name])
            keep_tracked(take, _CAMERA + name, found[name])
    return {name: kept.frames for name, kept in found.items() if kept is not None}


def _points(
    take: Take,
    recording: DepthRecording,
    calibration: Calibration,
    names: tuple[str, ...],
    progress: Progress | None,
    *,
    only_kept: bool,
) -> Tracked:
    """Return the skeletons of all cameras' points, and the performer that they show."""
    used = calibration.to_json()["cameras"]
    placed = {name: [used[name]["T_stage_camera"], used[name]["clock"]] for name in names}
    kept_as = f"{POINTS}-{blake2b(json.dumps(names).encode(), digest_size=6).hexdigest()}"
    tracked = read_tracked(take, kept_as, placed)
    if tracked is not None:
        return tracked
    _check_may_track(take, only_kept)
    clocks = {name: calibration.cameras[name].clock for name in names}
    images = _told(recording, recording.frames(names, clocks=clocks), names, progress)
    made = list(from_points(images, {name: recording.cameras[name] for name in names}, calibration))
    tracked = Tracked([frame for frame, _ in made], made[-1][1] if made else None)
    keep_tracked(take, kept_as, tracked, placed)
    return tracked


def _check_may_track(take: Take, only_kept: bool) -> None:
    if only_kept:
        raise TakeError(
            f"the depth of {take.path} has not been tracked with these settings; solve the take once"
        )


def calibrate_take(take: Take, *, reference: str | None = None) -> Calibration:
    """Return the calibration that a take's frames give; a bad one has the verdict `refused` and reasons.

    Skeletons are used as received, and the floor is the one that depth shows. A take that has only depth is tracked
    camera by camera, and the cameras are then refined on the body and the floor; all of it is used where its
    calibration part is too short for a walk.

    Raises:
        CalibrationError: no frames at all. SettingsError: no such reference camera.
    """
    summary, until_s = inspect_raw(take.raw_path), take.meta["calibration_s"]
    from_depth = bool(summary.depth_frames) and not any(summary.frames.values())
    floors: dict[str, Floor] = {}
    if summary.depth_frames:
        recording = DepthRecording(take.raw_path)
        floors = _floors(recording)
    if from_depth:
        frames = _skeletons(take, recording, tuple(recording.cameras))
        until_s = until_s if until_s is not None and until_s >= _LEAST_WALK_S else None
    else:
        frames = camera_frames(take.raw_path)
    if reference is not None and reference not in frames:
        raise SettingsError(f"--reference {reference}: no such camera; allowed: {', '.join(frames)}")
    calibration = calibrate(frames, reference=reference, until_s=until_s, floors=floors)
    calibration = follow_clocks(calibration, frames, until_s)
    if not from_depth or len(frames) < 2:
        return calibration
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    images = list(islice(recording.frames(clocks=clocks), MOST_SETS * len(frames)))
    return refine_camera_poses(images, recording.cameras, calibration)


def _floors(recording: DepthRecording) -> dict[str, Floor]:
    """Return the floors in a recording's first images, by camera, each in the camera's frame."""
    images: dict[str, list[NDArray[np.uint16]]] = {name: [] for name in recording.cameras}
    for frame in islice(recording.frames(), _FLOOR_IMAGES * len(images)):
        images[frame.camera].append(frame.depth_mm)
    return seen_floors(
        {name: (camera, images[name]) for name, camera in recording.cameras.items() if images[name]}
    )


def keep_calibration(take: Take, calibration: Calibration) -> int:
    """Keep a take's calibration under the next number, which comes back, and use it unless it was refused.

    Raises:
        CalibrationError: it was refused, with the reasons and what stays in use; it is kept all the same.
    """
    number = take.add_calibration(calibration, use=not calibration.refused)
    if calibration.refused:
        in_use = take.meta["calibration"]
        kept = "none is in use" if in_use is None else f"number {in_use} stays in use"
        raise CalibrationError(
            f"calibration {number} of {take.path} is refused ({kept}): {'; '.join(calibration.reasons())}"
        )
    return number


def _told(
    recording: DepthRecording, images: Iterator[DepthFrame], names: Iterable[str], progress: Progress | None
) -> Iterator[DepthFrame]:
    """Pass the images of cameras on and tell the share done."""
    total = sum(len(recording.times_ns(name)) for name in names)
    for done, image in enumerate(images):
        if progress is not None and done % 16 == 0:
            progress(_SHARE * done / max(total, 1))
        yield image

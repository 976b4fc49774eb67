"""Skeletons from the depth images of a take, for its solves by the `tracker` switch and for its calibration."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from hashlib import blake2b
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError, SettingsError, TakeError
from studio.engine.base.files import FileStamp, file_stamp
from studio.engine.base.sentences import say
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.cameras.drift import follow_clocks
from studio.engine.calibration.performer.depth_floor import seen_floors
from studio.engine.calibration.performer.floor import Floor
from studio.engine.calibration.quality.verdict import in_shoes
from studio.engine.calibration.views.drift import follow_views
from studio.engine.calibration.views.pictures import sees_no_depth
from studio.engine.calibration.views.seen.known_lens import KnownLens, check_lenses
from studio.engine.identity.whole_take import of_one
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.seeing.cameras.camera_poses import MOST_SETS, refine_camera_poses
from studio.engine.seeing.cameras.refine import Tracked as Track
from studio.engine.seeing.tracker.skeletons import POINTS, from_points, points_calibration
from studio.engine.whole_take.take import part_of_progress
from studio.offline.first_seconds import FirstSeconds
from studio.offline.placing import refined, refines, with_refined
from studio.offline.side_by_side import told, track_cameras
from studio.offline.so_far import Show
from studio.take.folder.take import Take
from studio.take.folder.tracked import Tracked, keep_tracked, read_tracked
from studio.take.raw.depth import DepthRecording, placed_cameras
from studio.take.raw.frames import camera_frames, inspect_raw
from studio.take.raw.index import indexed_topics
from studio.take.raw.kept_frames import several_bodies
from studio.take.raw.records import LIVE_TOPIC, is_depth_topic

Progress = Callable[[float], None]
_CAMERA = "camera-"
_LEAST_WALK_S = 10.0
_FLOOR_IMAGES = 5
_SHARE = 0.9
"""The approximate share of tracking in the time of a solve from depth."""

_REFINING = 0.3
"""Of the time that tracking takes, refining cameras takes about this share in a take of half a minute."""


class TrackedTake(NamedTuple):
    """The skeletons of a take with depth.

    Attributes:
        frames: by camera. calibration: places them. settings: to solve them with.
        figures: entries about the cameras for `metrics.json`; empty where they were not refined.
    """

    frames: Mapping[str, Sequence[CameraFrame]]
    calibration: Calibration
    settings: SolveSettings
    figures: SolveMetrics


def is_tracked(take: Take, settings: SolveSettings) -> bool:
    """Whether solves with these settings use skeletons tracked from depth instead of received ones."""
    depth, skeletons = _recorded(take.raw_path, file_stamp(take.raw_path))
    return depth and not (settings.tracker == "client" and skeletons)


@lru_cache(maxsize=8)
def _recorded(raw: Path, _: FileStamp) -> tuple[bool, bool]:
    """Return whether a raw file has depth images, and skeletons; it is read again when it changed."""
    topics = indexed_topics(raw)
    if topics is None:
        summary = inspect_raw(raw)
        return bool(summary.depth_frames), any(summary.frames.values())
    cameras = topics - {LIVE_TOPIC}
    return any(map(is_depth_topic, cameras)), not all(map(is_depth_topic, cameras))


def tracked_frames(
    take: Take,
    calibration: Calibration,
    settings: SolveSettings,
    progress: Progress | None = None,
    *,
    only_kept: bool = False,
    show: Show | None = None,
    processes: int | None = None,
) -> TrackedTake:
    """Return the skeletons of a take with depth.

    `tracker=points` gives one virtual camera, `points`, after refining the cameras if `refine_cameras` says so.
    `per_camera` gives one skeleton stream for every camera with depth. With `client`, a take without received
    skeletons is tracked per camera too, as clients would have done. Tracked skeletons are stored in the take.

    Args:
        progress: receives the share done.
        only_kept: only what an earlier solve has stored.
        show: receives a solve of `points` so far, while it is tracked.
        processes: see `track_cameras`.

    Raises:
        CalibrationError: none of the cameras has a transform.
        SettingsError: `cameras` names a missing camera.
        TakeError: with `only_kept`, if the take has not been tracked yet.
    """
    recording = DepthRecording(take.raw_path)
    placed = tuple(placed_cameras(take.path, recording, calibration))
    names = settings.camera_names(placed)
    if settings.tracker != "points":
        frames = _skeletons(take, recording, names, progress, only_kept=only_kept, processes=processes)
        return TrackedTake(frames, calibration, settings, {})
    refine = refines(settings, calibration, names)
    tracked = _points(
        take, recording, calibration, names, settings, progress, refine=refine, only_kept=only_kept, show=show
    )
    done = tracked.cameras or {}
    if done:
        calibration = with_refined(calibration, done)
    calibration = points_calibration(calibration, names, tracked.performer)
    return TrackedTake({POINTS: tracked.frames}, calibration, replace(settings, cameras="all"), done)


def _skeletons(
    take: Take,
    recording: DepthRecording,
    names: tuple[str, ...],
    progress: Progress | None = None,
    *,
    only_kept: bool = False,
    processes: int | None = None,
) -> Mapping[str, Sequence[CameraFrame]]:
    """Return each camera's own skeletons in order of time."""
    found = {name: read_tracked(take, _CAMERA + name) for name in names}
    missing = tuple(name for name, kept in found.items() if kept is None)
    if missing:
        _check_may_track(take, only_kept)
        part = part_of_progress(progress, 0.0, _SHARE)
        frames = track_cameras(take, recording, missing, part, processes=processes)
        for name in missing:
            found[name] = tracked = Tracked(frames[name])
            keep_tracked(take, _CAMERA + name, tracked)
    return {name: kept.frames for name, kept in found.items() if kept is not None}


def _points(
    take: Take,
    recording: DepthRecording,
    calibration: Calibration,
    names: tuple[str, ...],
    settings: SolveSettings,
    progress: Progress | None,
    *,
    refine: bool,
    only_kept: bool,
    show: Show | None,
) -> Tracked:
    """Return the skeletons from all cameras' points, the performer estimated with them, and how cameras moved."""
    used = calibration.to_json()["cameras"]
    placed = {name: [used[name]["T_stage_camera"], used[name]["clock"]] for name in names}
    key = json.dumps([names, "refined"] if refine else names)
    kept_as = f"{POINTS}-{blake2b(key.encode(), digest_size=6).hexdigest()}"
    tracked = read_tracked(take, kept_as, placed)
    if tracked is not None:
        return tracked
    _check_may_track(take, only_kept)
    clocks = {name: calibration.cameras[name].clock for name in names}
    done = None

    def first(most_parts: int | None) -> Track | None:
        """Return a function that shows the solve so far, with the cameras as placed by now."""
        if show is None:
            return None
        every = [clocks[name].stage_ns(int(t)) for name in names for t in recording.times_ns(name)[[0, -1]]]
        span_ns = max(min(every), round((take.meta["calibration_s"] or 0.0) * 1e9)), max(every)
        placed, together = points_calibration(calibration, names, None), replace(settings, cameras="all")
        return FirstSeconds(placed, together, span_ns, show, most_parts=most_parts).take

    if refine:
        calibration, done = refined(
            recording, calibration, names, part_of_progress(progress, 0.0, _REFINING), tracked=first(1)
        )
        progress = part_of_progress(progress, _REFINING, 1.0)
    images = told(
        recording, recording.frames(names, clocks=clocks), names, part_of_progress(progress, 0.0, _SHARE)
    )
    made, track = [], first(None)
    for frame, performer in from_points(
        images, {name: recording.cameras[name] for name in names}, calibration
    ):
        made.append((frame, performer))
        if track is not None:
            track(frame, performer)
    tracked = Tracked([frame for frame, _ in made], made[-1][1] if made else None, done)
    keep_tracked(take, kept_as, tracked, placed)
    return tracked


def _check_may_track(take: Take, only_kept: bool) -> None:
    if only_kept:
        raise TakeError(
            "depth.not_tracked",
            "the depth of {take} has not been tracked with these settings; solve the take once",
            take=take.path,
        )


def calibrate_take(
    take: Take,
    *,
    reference: str | None = None,
    height_m: float | None = None,
    lenses: Mapping[str, KnownLens] | None = None,
    same_lens: bool = False,
    readouts_ms: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Return the calibration from a take's frames; a bad one has the verdict `refused` and reasons.

    Spans in which cameras do not agree are left out and reported; the end of a calibration part must agree, because
    the rest is solved with it. Received skeletons are used, and the floor is the one seen in depth. A take with only
    depth is tracked camera by camera, reported by `progress`, and the cameras are then refined on the body and the
    floor. All of the take is used if its calibration part is too short for a walk.

    Args:
        height_m: the performer's, without shoes; without depth it gives the size of the stage, else it is compared
            with the measured one.
        lenses: the known lenses of cameras without depth.
        same_lens: all of those without a known lens have one focal length.
        readouts_ms: of cameras without depth, see `CameraCalibration`; 0 where none is given.

    Raises:
        CalibrationError: no frames at all.
        SettingsError: no such reference camera, or a lens for an unknown camera or one with depth.
    """
    summary, until_s = inspect_raw(take.raw_path), take.meta["calibration_s"]
    depth = DepthRecording(take.raw_path) if summary.depth_frames else None
    floors: dict[str, Floor] = {} if depth is None else _floors(depth)
    only_depth = None if any(summary.frames.values()) else depth
    if only_depth is not None:
        frames = _skeletons(take, only_depth, tuple(only_depth.cameras), progress)
        until_s = until_s if until_s is not None and until_s >= _LEAST_WALK_S else None
    else:
        frames = camera_frames(take.raw_path)
    frames = of_one(frames) if several_bodies(frames) else frames
    if reference is not None and reference not in frames:
        raise SettingsError(
            "calibration.no_such_reference",
            "--reference {name}: no such camera; allowed: {names}",
            name=reference,
            names=[*frames],
        )
    height = in_shoes(height_m)
    check_lenses(lenses or {}, [name for name, mine in frames.items() if sees_no_depth(mine)])
    calibration = calibrate(
        frames,
        reference=reference,
        until_s=until_s,
        height_m=height,
        floors=floors,
        clocks_within_s=take.common_clocks(),
        lenses=lenses,
        same_lens=same_lens,
        must_hold="somewhere" if until_s is None else "at_end",
        progress=progress if only_depth is None else None,
    )
    calibration = _with_readouts(calibration, readouts_ms or {})
    if all(camera.lens is not None for camera in calibration.cameras.values()):
        return follow_views(calibration, frames, until_s)
    calibration = follow_clocks(calibration, frames, until_s)
    if only_depth is None or len(frames) < 2:
        return calibration
    clocks = {name: camera.clock for name, camera in calibration.cameras.items()}
    images = list(islice(only_depth.frames(clocks=clocks), MOST_SETS * len(frames)))
    return refine_camera_poses(images, only_depth.cameras, calibration)


def _with_readouts(calibration: Calibration, readouts_ms: Mapping[str, float]) -> Calibration:
    return replace(
        calibration,
        cameras={
            name: camera if camera.lens is None else replace(camera, readout_ms=readouts_ms.get(name, 0.0))
            for name, camera in calibration.cameras.items()
        },
    )


def _floors(recording: DepthRecording) -> dict[str, Floor]:
    """Return the floors in a recording's first images, by camera, each in the camera's frame."""
    images: dict[str, list[NDArray[np.uint16]]] = {name: [] for name in recording.cameras}
    for frame in islice(recording.frames(), _FLOOR_IMAGES * len(images)):
        images[frame.camera].append(frame.depth_mm)
    return seen_floors(
        {name: (camera, images[name]) for name, camera in recording.cameras.items() if images[name]}
    )


def keep_calibration(take: Take, calibration: Calibration) -> int:
    """Store a take's calibration under the next number, which is returned, and use it unless it was refused.

    Raises:
        CalibrationError: it was refused, with the reasons and the calibration that stays in use; it is stored
            anyway.
    """
    number = take.add_calibration(calibration, use=not calibration.refused)
    if calibration.refused:
        in_use = take.meta["calibration"]
        none = say("calibration.none_in_use", "none is in use")
        kept = (
            none
            if in_use is None
            else say("calibration.stays", "number {number} stays in use", number=in_use)
        )
        raise CalibrationError(
            "calibration.refused_take",
            "calibration {number} of {take} is refused ({kept}): {reasons}",
            number=number,
            take=take.path,
            kept=kept,
            reasons=calibration.reasons(),
        )
    return number

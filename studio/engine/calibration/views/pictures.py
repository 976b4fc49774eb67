"""Ordinary cameras in a take or on the stage: their frames as views, and the result as a `Calibration`."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError
from studio.engine.base.sentences import Said, say
from studio.engine.calibration.views.beside import place_beside
from studio.engine.calibration.views.calibrate import calibrate_views
from studio.engine.calibration.views.judging.result import PlacedView
from studio.engine.calibration.views.seen.bodies import USUAL_HEIGHT_M
from studio.engine.calibration.views.seen.known_lens import KnownLens
from studio.engine.calibration.views.seen.view import View
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.model.joints import JOINT_COUNT

_MARGIN_S = 2.0
_ONE_CLOCK = 0.5
"""Least overlap of device times that shows a common clock, as a share of the shorter stream."""


def sees_no_depth(frames: Sequence[CameraFrame]) -> bool:
    """Whether a camera's frames are landmarks in pictures."""
    return len(frames) > 0 and all(frame.picture is not None for frame in frames)


def calibrate_pictures(
    frames: Mapping[str, Sequence[CameraFrame]],
    *,
    reference: str | None = None,
    until_s: float | None = None,
    height_m: float | None = None,
    clocks_within_s: Mapping[str, float] | None = None,
    lenses: Mapping[str, KnownLens] | None = None,
    same_lens: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Calibration:
    """Return the calibration of cameras that see no depth; a bad one has the verdict `refused` and reasons.

    The stage clock is the reference camera's.

    Args:
        frames: by camera, in device time order; see `sees_no_depth`.
        reference: the first camera with frames where None.
        until_s: use only the reference camera's frames up to this time on its clock [s].
        height_m: the performer's, which gives the size; 1.75 m where None.
        clocks_within_s: for cameras that already share a clock, the largest deviation of each from it [s].
        lenses: known lenses.
        same_lens: all cameras whose lens is unknown have one focal length.
        progress: called with the share that is done, 0..1.

    Raises:
        CalibrationError: the reference camera has no frames.
        SettingsError: a lens for pictures of another shape.
    """
    seen = {name: mine for name, mine in frames.items() if mine}
    first = reference if reference is not None else next(iter(seen), "")
    if first not in seen:
        raise CalibrationError(
            "calibration.reference_no_frames",
            "reference camera {name!r} has no frames; cameras: {names}",
            name=first,
            names=[*frames],
        )
    within_s = clocks_within_s or {}
    starts = _starts_ns(seen, first, within_s)
    ends_s = np.inf if until_s is None else until_s - starts[first] * 1e-9
    order = [first, *(name for name in seen if name != first)]
    views = [
        replace(
            view_of(name, seen[name], starts[name], ends_s + (_MARGIN_S if name != first else 0.0)),
            clock_within_s=within_s.get(name),
        )
        for name in order
    ]
    views = [_with_lens(view, lenses) for view in views]
    result = calibrate_views(views, height_m=height_m, shared_focal=same_lens, progress=progress)
    cameras = {name: _camera(result.cameras[name], starts[first] - starts[name]) for name in order}
    if not result.scale_known:
        cameras[first] = replace(cameras[first], reasons=(*cameras[first].reasons, _size_guessed()))
    return Calibration(first, cameras, result.performer)


def _size_guessed() -> Said:
    return say(
        "views.size_guessed",
        "the size of the stage is a guess: the performer was taken to be {m:.2f} m tall; give the height and "
        "calibrate again",
        m=USUAL_HEIGHT_M,
    )


def calibrate_beside(
    frames: Mapping[str, Sequence[CameraFrame]],
    reference: tuple[str, Sequence[CameraFrame]],
    device_s: NDArray[np.float64],
    joints_m: NDArray[np.float64],
    lenses: Mapping[str, KnownLens] | None = None,
) -> dict[str, CameraCalibration]:
    """Return cameras without depth, placed by the skeleton that depth cameras see; a bad one is `refused`.

    Args:
        frames: by camera, in device time order; see `sees_no_depth`.
        reference: the reference camera's name and frames.
        device_s: instants on the reference camera's clock [s], shape (instant_count,).
        joints_m: canonical joints at the instants, stage frame [m], shape (instant_count, 21, 3); NaN = unknown.
        lenses: known lenses.
    """
    name, own = reference
    starts = _starts_ns({name: own, **frames}, name)
    times_s = device_s - starts[name] * 1e-9
    placed = {
        camera: place_beside(
            _with_lens(view_of(camera, mine, starts[camera], np.inf), lenses), times_s, joints_m
        )
        for camera, mine in frames.items()
    }
    return {camera: _camera(one, starts[name] - starts[camera]) for camera, one in placed.items()}


def _starts_ns(
    frames: Mapping[str, Sequence[CameraFrame]], first: str, brought: Collection[str] = ()
) -> dict[str, int]:
    """Return the device time of each camera that counts as its beginning [ns].

    It is the reference's beginning if the clocks run together, otherwise the camera's first frame; cameras that
    already share a clock have the same one.
    """
    begin, end = (frames[first][i].device_time_ns for i in (0, -1))
    out = {}
    common = first if first in brought else next((name for name in frames if name in brought), first)
    for name, mine in frames.items():
        here, there = mine[0].device_time_ns, mine[-1].device_time_ns
        overlap = min(end, there) - max(begin, here)
        if name in brought:
            out[name] = frames[common][0].device_time_ns
            continue
        out[name] = begin if overlap > _ONE_CLOCK * min(end - begin, there - here) else here
    return out


def view_of(name: str, frames: Sequence[CameraFrame], start_ns: int, until_s: float) -> View:
    """Return a camera's frames as a view, with times since a device time. Frames after `until_s`, or with a picture
    size other than the last frame's, are left out."""
    last = frames[-1].picture
    assert last is not None
    used = [
        (frame, frame.picture, (frame.device_time_ns - start_ns) * 1e-9)
        for frame in frames
        if frame.picture is not None
        and (frame.picture.width, frame.picture.height) == (last.width, last.height)
    ]
    used = [one for one in used if one[2] <= until_s]
    joints = (len(used), JOINT_COUNT)
    return View(
        name,
        np.array([time_s for _, _, time_s in used]),
        np.array([picture.pixels for _, picture, _ in used]).reshape(*joints, 2),
        np.array([frame.confidence for frame, _, _ in used]).reshape(joints),
        np.array([picture.world_m for _, picture, _ in used]).reshape(*joints, 3),
        last.width,
        last.height,
    )


def _with_lens(view: View, lenses: Mapping[str, KnownLens] | None) -> View:
    known = (lenses or {}).get(view.name)
    if known is None:
        return view
    lens = known.of(view.name, view.width, view.height)
    return replace(view, lens=lens, focal_share=known.share)


def _camera(placed: PlacedView, begins_before_ns: int) -> CameraCalibration:
    """Return a placed camera as part of a calibration.

    Args:
        begins_before_ns: added to its device times, in addition to `ahead_s`, to give the reference's [ns].
    """
    rests = placed.rests
    return CameraCalibration(
        placed.T_stage_camera,
        clock=ClockModel(begins_before_ns + round(placed.ahead_s * 1e9)),
        residual_median_mm=rests.median_mm if rests.count else None,
        residual_p95_mm=rests.p95_mm if rests.count else None,
        residual_pairs=rests.count,
        coverage=placed.coverage,
        verdict=placed.verdict,
        reasons=placed.reasons,
        lens=placed.lens,
    )

"""Calibrates a stage from one performer who walks through it: clocks, camera poses, floor and proportions.

The steps: `first` (first clocks by `time_offset`, first transforms by `rigid`) -> `swaps` (left and right) ->
`refine` (all at once) -> `merge` (one skeleton) -> `stage` (`floor`, `tpose`, `proportions`) -> `residuals`,
`halves`, `handedness` and `verdict`. `together` runs the steps from `swaps` to `merge`; `holding` repeats them
without spans that do not agree, if that is allowed. Cameras that see no depth are calibrated by `views`; next to
depth cameras, the skeleton that those see places them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.first import Candidate, first_placements
from studio.engine.calibration.cameras.merge import Walk, merge
from studio.engine.calibration.cameras.pairs import LocalClock, grid, make_track
from studio.engine.calibration.cameras.refine import PlacedCamera
from studio.engine.calibration.holding import MustHold, fit_holding
from studio.engine.calibration.performer.depth_floor import common_floor
from studio.engine.calibration.performer.floor import Floor
from studio.engine.calibration.performer.proportions import measure
from studio.engine.calibration.performer.soles import on_soles
from studio.engine.calibration.performer.stage import find_stage, middle_of
from studio.engine.calibration.quality import residuals as quality
from studio.engine.calibration.quality.halves import Halves, compare_halves
from studio.engine.calibration.quality.handedness import mirrored_bodies
from studio.engine.calibration.quality.verdict import Facts, verdict
from studio.engine.calibration.together import Placements, swaps_between
from studio.engine.calibration.views.pictures import calibrate_beside, calibrate_pictures, sees_no_depth
from studio.engine.calibration.views.points import with_points
from studio.engine.calibration.views.seen.known_lens import KnownLens
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.model.spans import Span

_ENOUGH_FRAMES = 20_000
"""Largest number of a camera's frames from which a performer is measured: some ten minutes, which bounds memory."""

_SAME_PLACE_M = 0.05
_SAME_STREAM_M = 0.002


def calibrate(
    frames: Mapping[str, Sequence[CameraFrame]],
    *,
    reference: str | None = None,
    until_s: float | None = None,
    height_m: float | None = None,
    floors: Mapping[str, Floor] | None = None,
    must_hold: MustHold = "always",
    clocks_within_s: Mapping[str, float] | None = None,
    lenses: Mapping[str, KnownLens] | None = None,
    same_lens: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Calibration:
    """Return the calibration from the frames; a bad one has the verdict `refused` and reasons.

    The stage clock is the reference camera's; the stage's origin is the floor under the hips in the T-pose, else
    under the middle of the walk.

    Args:
        frames: by camera, in device time order, each on its own clock.
        reference: the reference camera; the first where None.
        until_s: use only the reference camera's frames up to this time on its clock [s].
        height_m: the performer's, if measured before; a height that disagrees is refused. For cameras that see no
            depth, it sets the size of the stage.
        floors: by camera, the floor that it sees, in its own frame (`depth_floor.seen_floors`).
        must_hold: when the cameras must agree. Unless it is `always`, spans without agreement are left out and
            reported (`CameraCalibration.disagrees`); all figures are then those of the rest.
        clocks_within_s: for cameras that see no depth and already share a clock, the largest deviation of each from
            it [s]; None = no camera does.
        lenses: known lenses of cameras that see no depth.
        same_lens: all of these cameras whose lens is unknown have one focal length.
        progress: for cameras that see no depth, called with the share that is done, 0..1.

    Raises:
        CalibrationError: no frames at all, or a reference camera without frames.
        SettingsError: a lens for pictures of another shape.
    """
    if any(frames.values()) and all(sees_no_depth(mine) for mine in frames.values() if mine):
        return calibrate_pictures(
            frames,
            reference=reference,
            until_s=until_s,
            height_m=height_m,
            clocks_within_s=clocks_within_s,
            lenses=lenses,
            same_lens=same_lens,
            progress=progress,
        )
    flat = {name: mine for name, mine in frames.items() if sees_no_depth(mine)}
    frames = {name: mine for name, mine in frames.items() if name not in flat}
    cameras = first_placements(frames, reference, until_s)
    kept, fit, spans = fit_holding([camera for camera in cameras if not camera.problem], must_hold)
    epoch_s = kept[0].track.epoch_ns * 1e-9
    poses = {name: camera.T for name, camera in zip(fit.names, fit.whole.cameras, strict=True)}
    T_stage, performer, floor_given = find_stage(
        fit.walk, common_floor(floors or {}, poses, middle_of(fit.walk))
    )
    walk = fit.walk.moved(T_stage)
    results = {}
    coverage, backwards = quality.coverage(walk), mirrored_bodies(walk, np.array([0.0, 0.0, 1.0]))
    halves = compare_halves(fit.tracks, fit.whole, fit.times_s, fit.swapped, walk, T_stage)
    for camera in cameras:
        if camera.problem:
            results[camera.name] = CameraCalibration(
                T_stage, residual_pairs=camera.pairs or 0, verdict="refused", reasons=(camera.problem,)
            )
        else:
            i = fit.names.index(camera.name)
            camera = replace(kept[i], mirrored=camera.mirrored or bool(backwards[i]))
            result = _result(
                camera, i, fit, walk, T_stage, performer, float(coverage[i]), halves[i], height_m, spans[i]
            )
            results[camera.name] = replace(result, disagrees=tuple(span.later(epoch_s) for span in spans[i]))
    if flat:
        own = cameras[0].name, frames[cameras[0].name]
        results |= calibrate_beside(flat, own, epoch_s + walk.times_s, walk.merged, lenses)
    return Calibration(cameras[0].name, results, performer, floor_given=floor_given)


def with_performer(
    calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]], *, another: bool = False
) -> Calibration:
    """Return the calibration with a missing performer measured from the frames.

    If only the performer's soles were not measured, only they are. Cameras and their clocks do not change.

    Args:
        calibration: to measure by.
        frames: by camera, in device time order, of the performer alone.
        another: the performer is not the one whose feet placed the floor; see `on_soles`.
    """
    known = [name for name in calibration.cameras if frames.get(name)]
    performer = calibration.performer
    if (performer is not None and performer.soles_measured) or not known:
        return calibration
    walk = walk_of(calibration, {name: frames[name] for name in known})
    performer = measure(walk) if performer is None else performer
    performer = None if performer is None else on_soles(performer, walk, lowest=another)
    floor_given = performer is not None and performer.soles_measured
    return replace(calibration, performer=performer, floor_given=floor_given)


def walk_of(calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]]) -> Walk:
    """Return one skeleton of a performer's frames in the stage frame, of the first ten minutes.

    Args:
        calibration: places every camera of `frames`.
        frames: by camera, in device time order, of one performer; none of them empty.
    """
    points = with_points(calibration, {name: mine[:_ENOUGH_FRAMES] for name, mine in frames.items()})
    known = sorted(frames, key=lambda name: name != calibration.reference)  # the reference first
    cameras = [calibration.cameras[name] for name in known]
    tracks = [make_track(points[name]) for name in known]
    starts_ns = [c.clock.stage_ns(track.epoch_ns) for c, track in zip(cameras, tracks, strict=True)]
    placed = [
        PlacedCamera(
            camera.T_stage_camera, LocalClock((start_ns - starts_ns[0]) * 1e-9, camera.clock.drift_ppm * 1e-6)
        )
        for camera, start_ns in zip(cameras, starts_ns, strict=True)
    ]
    times, bias = grid(tracks[0]), cameras[0].depth_bias_m
    return merge(tracks, placed, times, swaps_between(tracks, placed, times, bias), bias)


def _same_place(T: NDArray[np.float64]) -> bool:
    """Whether a camera has the position and direction of the reference; T: reference <- camera."""
    return float(np.linalg.norm(T[:3, 3])) < _SAME_PLACE_M and float(np.trace(T[:3, :3])) > 2.999


def _result(
    camera: Candidate,
    i: int,
    fit: Placements,
    walk: Walk,
    T_stage: NDArray[np.float64],
    performer: Performer | None,
    coverage: float,
    halves: Halves,
    height_m: float | None,
    left_out: list[Span],
) -> CameraCalibration:
    """Return one camera's calibration with its figures: fitted on even blocks, scored on odd ones."""
    T = T_stage @ fit.whole.cameras[i].T
    facts = Facts(
        camera_height_m=float(T[2, 3]),
        tilt_deg=float(np.degrees(np.arccos(np.clip(-T[2, 1], -1.0, 1.0)))),
        performer_height_m=None if performer is None else performer.height_m,
        known_height_m=height_m,
        feet_m=quality.lowest_feet(walk.positions[i]),
        mirrored=camera.mirrored,
        shift=fit.shifts[i] if len(fit.names) > 2 or i > 0 else None,
        left_out=tuple(left_out),
    )
    rest, clock = quality.Residuals(0.0, 0.0, 0.0, 0), ClockModel()
    if i > 0:
        odd = ~quality.even_blocks(fit.times_s)
        rest = quality.residuals(
            (fit.tracks[0], fit.tracks[i]), (fit.even.cameras[0], fit.even.cameras[i]),
            fit.times_s[odd], fit.swapped[i, odd], fit.even.depth_bias_m,
        )  # fmt: skip
        clock = fit.whole.cameras[i].clock.model(fit.tracks[i], fit.tracks[0])
        facts = replace(
            facts,
            pairs=camera.pairs,
            spread_m=camera.spread_m,
            agreement_m=rest.agreement_m,
            halves=halves,
            same_stream=_same_place(fit.whole.cameras[i].T) and (rest.agreement_m or 1.0) < _SAME_STREAM_M,
            clock_reason=camera.clock_reason,
            offset_sd_s=float(fit.whole.offset_sd_s[i]),
        )
    word, reasons = verdict(facts)
    return CameraCalibration(
        T,
        clock=clock,
        depth_bias_m=fit.whole.depth_bias_m if len(fit.names) > 1 else 0.0,
        residual_median_mm=None if rest.median_m is None else rest.median_m * 1e3,
        residual_p95_mm=None if rest.p95_m is None else rest.p95_m * 1e3,
        residual_pairs=rest.pairs,
        coverage=coverage,
        identity_error=quality.identity_error(walk.positions[0]) if i == 0 else None,
        verdict=word,
        reasons=reasons,
    )

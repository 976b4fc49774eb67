"""Calibrates a stage from one performer who walks through it: clocks, camera poses, floor and proportions.

The steps: `first` (first clocks by `time_offset`, first transforms by `rigid`) -> `swaps` (left and right) ->
`refine` (all at once) -> `merge` (one skeleton) -> `stage` (`floor`, `tpose`, `proportions`) -> `quality`,
`halves`, `handedness` and `verdict`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration import quality
from studio.engine.calibration.depth_floor import common_floor
from studio.engine.calibration.first import Candidate, first_placements
from studio.engine.calibration.floor import Floor
from studio.engine.calibration.halves import Halves, compare_halves
from studio.engine.calibration.handedness import mirrored_bodies
from studio.engine.calibration.merge import Walk, merge
from studio.engine.calibration.noise import unbiased
from studio.engine.calibration.pairs import LocalClock, Track, grid, make_track, sample
from studio.engine.calibration.proportions import measure
from studio.engine.calibration.refine import BIAS_PRIOR_M, Placed, Refined, refine
from studio.engine.calibration.result import Calibration, CameraCalibration, Performer
from studio.engine.calibration.soles import on_soles
from studio.engine.calibration.stage import find_stage, middle_of
from studio.engine.calibration.steadiness import Shift, largest_shifts
from studio.engine.calibration.swaps import exchange, find_swaps
from studio.engine.calibration.verdict import Facts, verdict
from studio.engine.frames import CameraFrame, ClockModel
from studio.engine.geometry import transform_points

_ENOUGH_FRAMES = 20_000
"""Of a camera, to measure a performer: some ten minutes, which keeps memory small whatever comes after."""

_SAME_PLACE_M = 0.05
_SAME_STREAM_M = 0.002


def calibrate(
    frames: Mapping[str, Sequence[CameraFrame]],
    *,
    reference: str | None = None,
    until_s: float | None = None,
    height_m: float | None = None,
    floors: Mapping[str, Floor] | None = None,
) -> Calibration:
    """Return the calibration that the frames give; a bad one has the verdict `refused` and reasons.

    The stage clock is the reference camera's; the stage's origin is the floor under the hips in the T-pose, else
    under the middle of the walk.

    Args:
        frames: by camera, in device time order, each on its own clock.
        reference: the reference camera; the first where None.
        until_s: use only what the reference camera saw up to this time on its clock [s].
        height_m: the performer's, where it was measured before; one that disagrees is refused.
        floors: by camera, the floor that it sees, in its own frame (`depth_floor.seen_floors`).

    Raises:
        CalibrationError: no frames at all, or a reference camera without frames.
    """
    cameras = first_placements(frames, reference, until_s)
    fit = _fit([camera for camera in cameras if not camera.problem])
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
            camera = replace(camera, mirrored=camera.mirrored or bool(backwards[i]))
            results[camera.name] = _result(
                camera, i, fit, walk, T_stage, performer, float(coverage[i]), halves[i], height_m
            )
    return Calibration(cameras[0].name, results, performer, floor_given=floor_given)


def with_performer(calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]]) -> Calibration:
    """Return the calibration with the performer measured from the frames, where it has none.

    Of a performer whose soles were not measured, only they are. Cameras and their clocks stay as they are.
    """
    known = [name for name in calibration.cameras if frames.get(name)]
    performer = calibration.performer
    if (performer is not None and performer.soles_measured) or not known:
        return calibration
    known.sort(key=lambda name: name != calibration.reference)  # the reference first, the others as they were
    cameras = [calibration.cameras[name] for name in known]
    tracks = [make_track(frames[name][:_ENOUGH_FRAMES]) for name in known]
    starts_ns = [c.clock.stage_ns(track.epoch_ns) for c, track in zip(cameras, tracks, strict=True)]
    placed = [
        Placed(
            camera.T_stage_camera, LocalClock((start_ns - starts_ns[0]) * 1e-9, camera.clock.drift_ppm * 1e-6)
        )
        for camera, start_ns in zip(cameras, starts_ns, strict=True)
    ]
    times, bias = grid(tracks[0]), cameras[0].depth_bias_m
    walk = merge(tracks, placed, times, _swaps(tracks, placed, times, bias), bias)
    performer = measure(walk) if performer is None else performer
    performer = None if performer is None else on_soles(performer, walk)
    floor_given = performer is not None and performer.soles_measured
    return replace(calibration, performer=performer, floor_given=floor_given)


@dataclass(frozen=True)
class _Fit:
    """All cameras placed, the reference first: on all frames, on even 5 s blocks, and the walk they give."""

    names: list[str]
    tracks: list[Track]
    times_s: NDArray[np.float64]
    swapped: NDArray[np.bool_]
    whole: Refined
    even: Refined
    walk: Walk
    shifts: list[Shift]


def _fit(cameras: list[Candidate]) -> _Fit:
    """Return all cameras placed together, starting from their first placements."""
    tracks = [camera.track for camera in cameras]
    start = [camera.placed for camera in cameras]
    clocks = np.array([camera.fit_clock for camera in cameras])
    times = grid(tracks[0])
    swapped = _swaps(tracks, start, times, BIAS_PRIOR_M)
    whole = even = Refined(start, BIAS_PRIOR_M, np.zeros(len(start)))
    if len(cameras) > 1:

        def fit(best: Refined, part: NDArray[np.bool_] | slice, iterations: int) -> Refined:
            return refine(
                tracks, best.cameras, times[part], swapped[:, part],
                depth_bias_m=best.depth_bias_m, fit_clocks=clocks, iterations=iterations,
            )  # fmt: skip

        whole = fit(whole, slice(None, None, 3), 4)
        swapped = _swaps(tracks, whole.cameras, times, whole.depth_bias_m)
        whole = fit(whole, slice(None, None, 2), 6)
        even = fit(whole, quality.even_blocks(times) & (np.arange(len(times)) % 2 == 0), 4)
    walk = merge(tracks, whole.cameras, times, swapped, whole.depth_bias_m)
    joints = _joints(tracks, whole.cameras, times, whole.depth_bias_m)
    ordered = np.array([exchange(mine, swap) for mine, swap in zip(joints, swapped, strict=True)])
    shifts = largest_shifts(ordered, times, quality.BLOCK_S)
    return _Fit([camera.name for camera in cameras], tracks, times, swapped, whole, even, walk, shifts)


def _swaps(
    tracks: list[Track], cameras: list[Placed], times_s: NDArray[np.float64], depth_bias_m: float
) -> NDArray[np.bool_]:
    """Return where each camera's left and right are exchanged, shape (camera_count, instant_count)."""
    return find_swaps(_joints(tracks, cameras, times_s, depth_bias_m))


def _joints(
    tracks: list[Track], cameras: list[Placed], times_s: NDArray[np.float64], depth_bias_m: float
) -> NDArray[np.float64]:
    """Return the cameras' joints in the reference's frame [m], shape (camera_count, instant_count, 21, 3)."""
    points = [
        transform_points(camera.T, unbiased(sample(track, camera.clock.device_s(times_s))[0], depth_bias_m))
        for track, camera in zip(tracks, cameras, strict=True)
    ]
    return np.array(points)


def _same_place(T: NDArray[np.float64]) -> bool:
    """Whether a camera stands and looks as the reference does; T: reference <- camera."""
    return float(np.linalg.norm(T[:3, 3])) < _SAME_PLACE_M and float(np.trace(T[:3, :3])) > 2.999


def _result(
    camera: Candidate,
    i: int,
    fit: _Fit,
    walk: Walk,
    T_stage: NDArray[np.float64],
    performer: Performer | None,
    coverage: float,
    halves: Halves,
    height_m: float | None,
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

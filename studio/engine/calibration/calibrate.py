"""Calibrates a stage from one performer who walks through it: clocks, camera poses, floor and proportions.

The steps: `time_offset` (first clocks) -> `rigid` (first transforms) -> `swaps` (left and right) -> `refine` (all at
once) -> `merge` (one skeleton) -> `floor`, `tpose` (the stage frame) -> `proportions` -> `quality` (the verdicts).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration import quality
from studio.engine.calibration.floor import Floor, body_up, find_floor, stage_from_walk
from studio.engine.calibration.merge import Walk, merge
from studio.engine.calibration.noise import unbiased
from studio.engine.calibration.pairs import LocalClock, Track, grid, make_track, sample
from studio.engine.calibration.proportions import measure
from studio.engine.calibration.refine import BIAS_PRIOR_M, Placed, Refined, refine
from studio.engine.calibration.result import Calibration, CameraCalibration, Performer
from studio.engine.calibration.rigid import RigidFit, fit_robust, middle_points, mirrored, spread_m
from studio.engine.calibration.swaps import find_swaps
from studio.engine.calibration.time_offset import find_shift
from studio.engine.calibration.tpose import ACROSS_BODY, ACROSS_TPOSE, facing, find_tpose
from studio.engine.errors import CalibrationError
from studio.engine.frames import CameraFrame, ClockModel
from studio.engine.geometry import make_transform, transform_points
from studio.engine.joints import INDEX

_DEFAULT_HEIGHT_M = 1.75
_MARGIN_S = 1.0
_SAME_CLOCK_S = 2.0
_EYE_LEVEL_M = 1.2
_FIRST_INSTANTS = 30


@dataclass
class _Camera:
    """A camera while it is being calibrated."""

    name: str
    track: Track
    placed: Placed
    fit_clock: bool = False
    clock_reason: str = ""
    mirrored: bool = False
    pairs: int = 0
    spread: NDArray[np.float64] | None = None
    problem: str = ""


def calibrate(
    frames: dict[str, list[CameraFrame]], *, reference: str | None = None, until_s: float | None = None
) -> Calibration:
    """Return the calibration that the frames give; a bad one has the verdict `refused` and reasons.

    The stage clock is the reference camera's; the stage's origin is the floor under the hips in the T-pose, else
    under the middle of the walk.

    Args:
        frames: by camera, in device time order, each on its own clock.
        reference: the reference camera; the first where None.
        until_s: use only what the reference camera saw up to this time on its clock [s].

    Raises:
        CalibrationError: no frames at all, or an unknown reference camera.
    """
    cameras = _cameras(frames, reference, until_s)
    for camera in cameras[1:]:
        _place_first(camera, cameras[0])
    placed = [cameras[0]] + [camera for camera in cameras[1:] if not camera.problem]
    times = grid(cameras[0].track)
    tracks = [camera.track for camera in placed]
    fit_clocks = np.array([camera.fit_clock for camera in placed])
    swapped = _swaps(tracks, [camera.placed for camera in placed], times, BIAS_PRIOR_M)
    refined = Refined([camera.placed for camera in placed], BIAS_PRIOR_M, np.zeros(len(placed)))
    halves: list[Refined] = []
    if len(placed) > 1:
        start = refined.cameras
        refined = _refine(tracks, start, times, swapped, fit_clocks, refined, 4, 3)
        swapped = _swaps(tracks, refined.cameras, times, refined.depth_bias_m)
        refined = _refine(tracks, start, times, swapped, fit_clocks, refined, 6, 2)
        even = quality.even_blocks(times)
        halves = [
            _refine(tracks, start, times[half], swapped[:, half], fit_clocks, refined, 4, 2)
            for half in (even, ~even)
        ]
    walk = merge(tracks, refined.cameras, times, swapped, refined.depth_bias_m)
    T_stage, performer = _stage(walk)
    return _result(cameras, placed, refined, halves, walk.moved(T_stage), T_stage, performer)


def with_performer(calibration: Calibration, frames: dict[str, list[CameraFrame]]) -> Calibration:
    """Return the calibration with the performer measured from the frames, where it has none.

    The cameras stay as they are; their clocks are taken as the calibration has them.
    """
    known = [name for name in calibration.cameras if frames.get(name)]
    if calibration.performer is not None or not known:
        return calibration
    first = calibration.reference if calibration.reference in known else known[0]
    names = [first] + [name for name in known if name != first]
    tracks = [make_track(frames[name]) for name in names]
    stage_epoch = calibration.cameras[first].clock.stage_ns(tracks[0].epoch_ns)
    placed = []
    for name, track in zip(names, tracks, strict=True):
        camera = calibration.cameras[name]
        offset_s = (camera.clock.stage_ns(track.epoch_ns) - stage_epoch) * 1e-9
        placed.append(Placed(camera.T_stage_camera, LocalClock(offset_s, camera.clock.drift_ppm * 1e-6, 0.0)))
    times, bias = grid(tracks[0]), calibration.cameras[first].depth_bias_m
    walk = merge(tracks, placed, times, _swaps(tracks, placed, times, bias), bias)
    return replace(calibration, performer=measure(walk))


def _cameras(
    frames: dict[str, list[CameraFrame]], reference: str | None, until_s: float | None
) -> list[_Camera]:
    """Return the cameras, the reference first, cut to the calibration part."""
    if not any(frames.values()):
        raise CalibrationError("no frames to calibrate from; record a T-pose and a walk with every camera")
    first = reference if reference is not None else next(name for name, mine in frames.items() if mine)
    if not frames.get(first):
        raise CalibrationError(f"reference camera {first!r} has no frames; cameras: {', '.join(frames)}")
    tracks = {name: make_track(frames[name]) for name in [first, *(n for n in frames if n != first)]}
    if until_s is not None:
        length = until_s - tracks[first].epoch_ns * 1e-9
        tracks[first] = tracks[first].until(length)
        for name, track in tracks.items():
            ahead = (track.epoch_ns - tracks[first].epoch_ns) * 1e-9
            if name != first:
                margin = _MARGIN_S - ahead if abs(ahead) < _SAME_CLOCK_S else 2 * _MARGIN_S
                tracks[name] = track.until(length + margin)
    start = Placed(np.eye(4), LocalClock())
    return [_Camera(name, track, start) for name, track in tracks.items()]


def _place_first(camera: _Camera, reference: _Camera) -> None:
    """Find a camera's first clock and transform, or its `problem`."""
    if len(camera.track.times_s) < 2 or len(reference.track.times_s) < 2:
        camera.problem = "no frames in the calibration part: check that the camera was running"
        return
    ahead = (camera.track.epoch_ns - reference.track.epoch_ns) * 1e-9
    same_clock = abs(ahead) < _SAME_CLOCK_S
    shift = find_shift(camera.track, reference.track, near_s=ahead if same_clock else None)
    offset = shift.offset_s if shift.found else (ahead if same_clock else 0.0)
    camera.fit_clock, camera.clock_reason = shift.found, shift.reason
    clock = LocalClock(offset, 0.0, float(camera.track.times_s[-1] / 2))
    times = grid(reference.track)
    here, _ = sample(camera.track, clock.device_s(times))
    there, _ = sample(reference.track, times)
    camera.pairs = int((np.isfinite(here) & np.isfinite(there)).all(axis=2).sum())
    source = middle_points(unbiased(here, BIAS_PRIOR_M))
    target = middle_points(unbiased(there, BIAS_PRIOR_M))
    seen = np.isfinite(source).all(axis=2) & np.isfinite(target).all(axis=2)
    if seen.sum() < 30:
        camera.problem = (
            f"only {camera.pairs} joint pairs with the reference camera: walk where both cameras see you"
        )
        return
    fit: RigidFit = fit_robust(source[seen], target[seen])
    camera.mirrored = mirrored(source[seen], target[seen], fit)
    camera.spread = spread_m(there[:, INDEX["hips"]][np.isfinite(there[:, INDEX["hips"]]).all(axis=1)])
    camera.placed = Placed(fit.T, clock)


def _swaps(
    tracks: list[Track], cameras: list[Placed], times: NDArray[np.float64], bias: float
) -> NDArray[np.bool_]:
    points = [
        transform_points(camera.T, unbiased(sample(track, camera.clock.device_s(times))[0], bias))
        for track, camera in zip(tracks, cameras, strict=True)
    ]
    return find_swaps(np.array(points))


def _refine(
    tracks: list[Track],
    start: list[Placed],
    times: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    fit_clocks: NDArray[np.bool_],
    best: Refined,
    iterations: int,
    every: int,
) -> Refined:
    """Refine from the best placements so far, with every second or third instant: neighbours say nearly the same."""
    begin = [
        Placed(now.T, replace(first.clock, offset_s=now.clock.offset_s))
        for now, first in zip(best.cameras, start, strict=True)
    ]
    return refine(
        tracks, begin, times[::every], swapped[:, ::every],
        depth_bias_m=best.depth_bias_m, fit_clocks=fit_clocks, iterations=iterations,
    )  # fmt: skip


def _stage(walk: Walk) -> tuple[NDArray[np.float64], Performer | None]:
    """Return T_stage_walk and the performer; where no floor is found, an upright stage at eye level of the camera."""
    up = body_up(walk)
    if up is None:
        return make_transform(
            np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([0, 0, _EYE_LEVEL_M])
        ), None
    floor = Floor(up, 0.0)
    height = _DEFAULT_HEIGHT_M
    performer = None
    for _ in range(
        2
    ):  # the heights of ankles and toes follow from the performer's height, and this from the floor
        found = find_floor(walk, height)
        floor = found if found is not None else floor
        T = _stage_frame(walk, floor)
        performer = measure(walk.moved(T))
        height = height if performer is None else performer.height_m
    return T, performer


def _stage_frame(walk: Walk, floor: Floor) -> NDArray[np.float64]:
    """Return T_stage_walk: from the T-pose, else origin under the middle of the walk, facing as it starts."""
    hold = find_tpose(walk, floor.up)
    start, across = slice(0, _FIRST_INSTANTS), ACROSS_BODY
    place = slice(None)
    if hold is not None:
        start, across, place = hold.frames, ACROSS_TPOSE, hold.frames
    forward = facing(walk.merged[start], floor.up, across)
    if forward is None:
        forward = facing(walk.merged, floor.up, ACROSS_BODY)
    if forward is None:  # no body was seen from the side: towards the reference camera
        forward = np.array([0.0, 0.0, -1.0])
    hips = walk.merged[place, INDEX["hips"]]
    hips = hips[np.isfinite(hips).all(axis=1)]
    return stage_from_walk(floor, np.median(hips, axis=0) if len(hips) else np.zeros(3), forward)


def _result(
    cameras: list[_Camera],
    placed: list[_Camera],
    refined: Refined,
    halves: list[Refined],
    walk: Walk,
    T_stage: NDArray[np.float64],
    performer: Performer | None,
) -> Calibration:
    """Return the calibration with figures and verdicts."""
    seen = dict(zip([c.name for c in placed], quality.coverage(walk.positions), strict=True))
    odd = ~quality.even_blocks(walk.times_s)
    out = {}
    for camera in cameras:
        if camera.problem:
            out[camera.name] = CameraCalibration(
                T_stage, residual_pairs=camera.pairs, verdict="refused", reasons=(camera.problem,)
            )
            continue
        i = placed.index(camera)
        final = refined.cameras[i]
        T = T_stage @ final.T
        facts = quality.Facts(
            camera_height_m=float(T[2, 3]), upside_down=bool(-T[2, 1] < 0.5), mirrored=camera.mirrored
        )
        rest = quality.Residuals(0.0, 0.0, 0)
        if i > 0:
            fitted, other = halves
            rest = quality.residuals(
                (placed[0].track, camera.track),
                (fitted.cameras[0], fitted.cameras[i]), walk.times_s[odd], fitted.depth_bias_m,
            )  # fmt: skip
            facts = replace(
                facts,
                pairs=camera.pairs,
                spread_m=camera.spread,
                median_m=rest.median_m,
                blocks=quality.disagreement(fitted.cameras[i].T, other.cameras[i].T, T_stage),
                clock_reason=camera.clock_reason,
                offset_sd_s=float(refined.offset_sd_s[i]),
            )
        verdict, reasons = quality.verdict(facts)
        out[camera.name] = CameraCalibration(
            T,
            clock=ClockModel() if i == 0 else final.clock.model(camera.track, placed[0].track),
            depth_bias_m=refined.depth_bias_m if len(placed) > 1 else 0.0,
            residual_median_mm=rest.median_m * 1e3,
            residual_p95_mm=rest.p95_m * 1e3,
            residual_pairs=rest.pairs,
            coverage=float(seen[camera.name]),
            verdict=verdict,
            reasons=reasons,
        )
    return Calibration(reference=cameras[0].name, cameras=out, performer=performer)

"""The first placement of every camera: its frames cut to the calibration part, its clock and its transform."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.noise import unbiased
from studio.engine.calibration.pairs import LocalClock, Track, grid, make_track, sample
from studio.engine.calibration.refine import BIAS_PRIOR_M, Placed
from studio.engine.calibration.rigid import fit_robust, middle_points, mirrored, spread_m
from studio.engine.calibration.time_offset import find_shift
from studio.engine.errors import CalibrationError
from studio.engine.frames import CameraFrame
from studio.engine.joints import INDEX

_MARGIN_S = 1.0
_MIN_INSTANTS = 30
_MIN_POINTS = 300


@dataclass(frozen=True)
class Candidate:
    """A camera before refinement.

    Attributes:
        name: the camera's.
        track: its frames of the calibration part.
        placed: its first placement, reference <- camera.
        fit_clock: whether its clock may be refined from the motion; `clock_reason` says why not.
        pairs: joints that it and the reference reported at one instant.
        spread_m: of the places where the reference saw the hips [m], see `rigid.spread_m`.
        mirrored: its stream is a mirror image.
        problem: why it cannot be placed at all; empty where it can.
    """

    name: str
    track: Track
    placed: Placed = field(default_factory=lambda: Placed(np.eye(4), LocalClock()))
    fit_clock: bool = False
    clock_reason: str = ""
    pairs: int | None = None
    spread_m: NDArray[np.float64] | None = None
    mirrored: bool = False
    problem: str = ""


def first_placements(
    frames: Mapping[str, Sequence[CameraFrame]], reference: str | None, until_s: float | None
) -> list[Candidate]:
    """Return every camera with its first placement, the reference first.

    Raises:
        CalibrationError: no frames at all, or a reference camera without frames.
    """
    if not any(frames.values()):
        raise CalibrationError("no frames to calibrate from; record a T-pose and a walk with every camera")
    first = reference if reference is not None else next(name for name, mine in frames.items() if mine)
    if not frames.get(first):
        raise CalibrationError(f"reference camera {first!r} has no frames; cameras: {', '.join(frames)}")
    main = make_track(frames[first])
    if until_s is not None:
        main = main.until(until_s - main.epoch_ns * 1e-9)
    others = [_place(name, make_track(frames[name]), main, until_s) for name in frames if name != first]
    return [Candidate(first, main), *others]


def _same_clock(track: Track, reference: Track) -> bool:
    """Whether the clocks are so close that the cameras' device times overlap for most of the shorter one."""
    ahead = (track.epoch_ns - reference.epoch_ns) * 1e-9
    overlap = min(ahead + track.times_s[-1], reference.times_s[-1]) - max(ahead, 0.0)
    return overlap > 0.5 * min(track.times_s[-1], reference.times_s[-1])


def _place(name: str, track: Track, reference: Track, until_s: float | None) -> Candidate:
    """Return a camera with its first clock and transform, or its problem."""
    if len(track.times_s) < 2 or len(reference.times_s) < 2:
        problem = "no frames in the calibration part: check that the camera was running"
        return Candidate(name, track, problem=problem)
    near_s = (track.epoch_ns - reference.epoch_ns) * 1e-9 if _same_clock(track, reference) else None
    if until_s is not None:
        track = track.until(reference.times_s[-1] - (near_s or 0.0) + _MARGIN_S)
    shift = find_shift(track, reference, near_s=near_s)
    clock = LocalClock(shift.offset_s, 0.0, float(np.median(track.times_s)) if len(track.times_s) else 0.0)
    times = grid(reference)
    here, there = sample(track, clock.device_s(times))[0], sample(reference, times)[0]
    pairs = int((np.isfinite(here) & np.isfinite(there)).all(axis=2).sum())
    source, target = (middle_points(unbiased(points, BIAS_PRIOR_M)) for points in (here, there))
    seen = np.isfinite(source).all(axis=2) & np.isfinite(target).all(axis=2)
    if seen.sum() < _MIN_POINTS or seen.any(axis=1).sum() < _MIN_INSTANTS:
        problem = f"only {pairs} joint pairs with the reference camera: walk where both cameras see you"
        return Candidate(name, track, pairs=pairs, problem=problem)
    fit = fit_robust(source[seen], target[seen])
    fit_clock = shift.found or (shift.lively and near_s is not None)  # near enough for `refine`
    hips = there[:, INDEX["hips"]]
    return Candidate(
        name,
        track,
        Placed(fit.T, clock),
        fit_clock=fit_clock,
        clock_reason="" if fit_clock else shift.reason,
        pairs=pairs,
        spread_m=spread_m(hips[np.isfinite(hips).all(axis=1)]),
        mirrored=mirrored(source[seen], target[seen], fit),
    )

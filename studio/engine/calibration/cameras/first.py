"""The first placement of every camera: its frames of the calibration part, its clock and its transform."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError
from studio.engine.base.sentences import say
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.calibration.cameras.pairs import LocalClock, Track, grid, make_track, sample
from studio.engine.calibration.cameras.refine import BIAS_PRIOR_M, PlacedCamera
from studio.engine.calibration.cameras.rigid import fit_robust, middle_points, mirrored, spread_m
from studio.engine.calibration.cameras.time_offset import find_shift
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX

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
        pairs: number of joints that it and the reference reported at one instant.
        spread_m: of the places where the reference saw the hips [m], see `rigid.spread_m`.
        mirrored: its stream is a mirror image.
        problem: why it cannot be placed; empty where it can.
    """

    name: str
    track: Track
    placed: PlacedCamera = field(default_factory=lambda: PlacedCamera(np.eye(4), LocalClock()))
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
        raise CalibrationError(
            "calibration.no_frames",
            "no frames to calibrate from; record a T-pose and a walk with every camera",
        )
    first = reference if reference is not None else next(name for name, mine in frames.items() if mine)
    if not frames.get(first):
        raise CalibrationError(
            "calibration.reference_no_frames",
            "reference camera {name!r} has no frames; cameras: {names}",
            name=first,
            names=[*frames],
        )
    main = make_track(frames[first])
    if until_s is not None:
        main = main.until(until_s - main.epoch_ns * 1e-9)
    others = [_place(name, make_track(frames[name]), main, until_s) for name in frames if name != first]
    return [Candidate(first, main), *others]


def _same_clock(track: Track, reference: Track) -> bool:
    """Whether the device times overlap for most of the shorter track, which shows a common clock."""
    ahead = (track.epoch_ns - reference.epoch_ns) * 1e-9
    overlap = min(ahead + track.times_s[-1], reference.times_s[-1]) - max(ahead, 0.0)
    return overlap > 0.5 * min(track.times_s[-1], reference.times_s[-1])


def _place(name: str, track: Track, reference: Track, until_s: float | None) -> Candidate:
    """Return a camera with its first clock and transform, or its problem."""
    if len(track.times_s) < 2 or len(reference.times_s) < 2:
        problem = say(
            "verdict.no_frames_in_part",
            "no frames in the calibration part: check that the camera was running",
        )
        return Candidate(name, track, problem=problem)
    near_s = (track.epoch_ns - reference.epoch_ns) * 1e-9 if _same_clock(track, reference) else None
    if until_s is not None:
        track = track.until(reference.times_s[-1] - (near_s or 0.0) + _MARGIN_S)
    shift = find_shift(track, reference, near_s=near_s)
    clock = LocalClock(shift.offset_s, 0.0, float(np.median(track.times_s)) if len(track.times_s) else 0.0)
    times = grid(reference)
    here, there = sample(track, clock.device_s(times))[0], sample(reference, times)[0]
    pairs = _pairs(here, there)
    source, target = (middle_points(unbiased(points, BIAS_PRIOR_M)) for points in (here, there))
    seen = np.all(np.isfinite(source), axis=2) & np.all(np.isfinite(target), axis=2)
    if seen.sum() < _MIN_POINTS or seen.any(axis=1).sum() < _MIN_INSTANTS:
        problem = say(
            "verdict.few_pairs_seen",
            "only {pairs} joint pairs with the reference camera: walk where both cameras see you",
            pairs=pairs,
        )
        return Candidate(name, track, pairs=pairs, problem=problem)
    fit = fit_robust(source[seen], target[seen])
    fit_clock = shift.found or (shift.lively and near_s is not None)  # near enough for `refine`
    return Candidate(
        name,
        track,
        PlacedCamera(fit.T, clock),
        fit_clock=fit_clock,
        clock_reason="" if fit_clock else shift.reason,
        pairs=pairs,
        spread_m=_walked(there),
        mirrored=mirrored(source[seen], target[seen], fit),
    )


def counted(camera: Candidate, reference: Track) -> Candidate:
    """Return a placed camera with pairs and spread counted again, after frames were left out of either track."""
    times = grid(reference)
    here, there = sample(camera.track, camera.placed.clock.device_s(times))[0], sample(reference, times)[0]
    return replace(camera, pairs=_pairs(here, there), spread_m=_walked(there))


def _pairs(here: NDArray[np.float64], there: NDArray[np.float64]) -> int:
    """Return the number of joints that two cameras report at one instant, of shape (instant_count, 21, 3)."""
    return int((np.isfinite(here) & np.isfinite(there)).all(axis=2).sum())


def _walked(reference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the spread of the hips' places in the reference [m], from its joints of shape (instant_count, 21, 3)."""
    hips = reference[:, INDEX["hips"]]
    return spread_m(hips[np.isfinite(hips).all(axis=1)])

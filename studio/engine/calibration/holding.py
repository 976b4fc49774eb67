"""Calibration from the part of a recording in which its cameras agree.

A camera that is knocked over, another person in view, or a performer at the edge of a view spoils seconds of a
recording, not all of it. Cameras are placed by all frames. Spans with large differences (`spans`) are then left out,
and the cameras are placed again, until the spans no longer change. Residuals, halves, floor and performer are those
of the rest.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.first import Candidate, counted
from studio.engine.calibration.cameras.pairs import GRID_HZ, Track
from studio.engine.calibration.cameras.swaps import exchange, find_swaps
from studio.engine.calibration.quality.spans import Shifts, inside_any
from studio.engine.calibration.together import Placements, fit_together, joints_of
from studio.engine.model.spans import Span

MustHold = Literal["always", "at_end", "somewhere"]
"""When cameras must agree: throughout; at the end, because later frames are solved with it; or anywhere."""

LEAST_S = 20.0
"""Shortest agreement for a calibration."""

_ROUNDS = 5
_ALIKE_S = 0.5
_LEAST_JOINTS = 5

Spans = list[list[Span]]


def fit_holding(cameras: list[Candidate], must_hold: MustHold) -> tuple[list[Candidate], Placements, Spans]:
    """Return the cameras without their disagreeing spans, their placements, and the spans that were left out.

    If too little is left, or not the part that must hold, all frames are used, and the verdict refuses the result.

    Args:
        cameras: with their first placements, the reference first.
        must_hold: see `MustHold`.
    """
    everything = fit_together(cameras)
    nothing: Spans = [[] for _ in cameras]
    if must_hold == "always" or len(cameras) < 2:
        return cameras, everything, nothing
    fit, kept, left_out = everything, cameras, nothing
    for _ in range(_ROUNDS):
        shifts = _shifts(cameras, fit)
        spans = (shifts.steps() if left_out is nothing else None) or shifts.spans()
        if _alike(spans, left_out):
            # two cameras cannot show which one is wrong: the reference gets no spans
            told = spans if len(cameras) > 2 else [[], spans[1]]
            return kept, fit, told
        if must_hold == "at_end" and any(span.to_s is None for mine in spans for span in mine):
            break
        kept = _without(cameras, fit, spans)
        if (
            min(_agreeing_s([kept[0].track, other.track], fit, i) for i, other in enumerate(kept) if i)
            < LEAST_S
        ):
            break
        fit, left_out = fit_together(kept), spans
    return cameras, everything, nothing


def _shifts(cameras: list[Candidate], fit: Placements) -> Shifts:
    """Return each camera's distances from the others, placed as in `fit`, on the reference's clock [s]."""
    tracks = [camera.track for camera in cameras]
    joints = joints_of(tracks, fit.whole.cameras, fit.times_s, fit.whole.depth_bias_m)
    shifts = Shifts(len(cameras))
    shifts.add(
        np.array([exchange(mine, swap) for mine, swap in zip(joints, find_swaps(joints), strict=True)]),
        fit.times_s,
    )
    return shifts


def _alike(a: Spans, b: Spans) -> bool:
    """Whether two rounds found the same spans."""
    if [len(mine) for mine in a] != [len(mine) for mine in b]:
        return False
    pairs = [pair for mine, others in zip(a, b, strict=True) for pair in zip(mine, others, strict=True)]
    return all(
        abs(x.from_s - y.from_s) <= _ALIKE_S
        and (x.to_s is None) == (y.to_s is None)
        and abs((x.to_s or 0.0) - (y.to_s or 0.0)) <= _ALIKE_S
        for x, y in pairs
    )


def _without(cameras: list[Candidate], fit: Placements, spans: Spans) -> list[Candidate]:
    """Return the cameras without joints in their spans, with the placements of `fit` as their start."""
    kept = [
        replace(
            camera,
            track=_blind(camera.track, placed.clock.reference_s(camera.track.times_s), mine),
            placed=placed,
        )
        for camera, placed, mine in zip(cameras, fit.whole.cameras, spans, strict=True)
    ]
    return [kept[0], *(counted(camera, kept[0].track) for camera in kept[1:])]


def _blind(track: Track, reference_s: NDArray[np.float64], spans: list[Span]) -> Track:
    """Return the track without joints in frames whose times on the reference's clock lie in the spans."""
    out = inside_any(spans, reference_s)
    positions, confidence = track.positions.copy(), track.confidence.copy()
    positions[out], confidence[out] = np.nan, 0.0
    return replace(track, positions=positions, confidence=confidence)


def _agreeing_s(tracks: list[Track], fit: Placements, i: int) -> float:
    """Return the time for which the reference and camera `i`, with these tracks, see the performer together [s]."""
    placed = [fit.whole.cameras[0], fit.whole.cameras[i]]
    joints = joints_of(tracks, placed, fit.times_s, 0.0)
    both = np.isfinite(joints).all(axis=(0, 3)).sum(axis=1) >= _LEAST_JOINTS
    return float(both.sum() / GRID_HZ)

"""Figures of a solve of several performers, each against a reference: their own, and identity switches."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.evaluate import evaluate
from studio.engine.metrics.reference.alignment import Alignment, align_together
from studio.engine.metrics.reference.clock import on_one_clock
from studio.engine.metrics.reference.matching import match
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.metrics.results import SeveralEvaluation
from studio.engine.model.poses import Poses

_LEAST_STAY_S = 0.2
"""Shortest time nearer to another reference that counts as an identity switch."""

Spans = Sequence[Sequence[float]]
"""Start and end of each span in stage time [s]."""


def evaluate_several(
    poses: Mapping[str, Poses],
    references: Mapping[str, Reference | Markers],
    *,
    undecided_s: Mapping[str, Spans] | None = None,
    recorded_s: Spans | None = None,
    start_s: float | None = None,
    same_clock: bool = True,
    similarity: bool = False,
) -> SeveralEvaluation:
    """Return the figures of all performers that have a reference, with one alignment.

    Args:
        poses: by performer.
        references: by performer.
        undecided_s: spans in which a performer could not be distinguished from another, by performer.
        recorded_s: spans in which cameras sent frames; nothing can be missed outside. None = throughout.
        start_s, same_clock, similarity: as in `evaluate`.

    Raises:
        FormatError: a solve and its reference share too little time or too few joints.
    """
    centres, clocks, matches = {}, {}, {}
    for name, reference in references.items():
        centres[name], _, clocks[name] = on_one_clock(poses[name], reference, start_s, same_clock)
        matches[name] = match(
            poses[name], centres[name], start_s=start_s, offset_s=clocks[name][0], drift_ppm=clocks[name][1]
        )
    together = align_together(list(matches.values()), similarity=similarity)
    figures = {
        name: evaluate(
            poses[name], reference, start_s=start_s, same_clock=same_clock, similarity=similarity,
            alignment=together,
        )
        for name, reference in references.items()
    }  # fmt: skip
    on_stage = {name: _stage_times_s(centres[name], clocks[name], start_s) for name in references}
    if recorded_s is not None:
        on_stage = {name: times[_inside(times, recorded_s)] for name, times in on_stage.items()}
    count = sum(len(times) for times in on_stage.values())
    missed = sum(int(_missed(on_stage[name], poses[name]).sum()) for name in references)
    doubted = sum(
        int(_inside(on_stage[name], (undecided_s or {}).get(name, ())).sum()) for name in references
    )
    return {
        "performers": figures,
        "identity_switches": sum(
            _switches(poses[name], centres, clocks, start_s, together) for name in references
        ),
        "missed_percent": 100.0 * missed / max(count, 1),
        "undecided_percent": 100.0 * doubted / max(count, 1),
    }


def _stage_times_s(
    reference: Reference, clock: tuple[float, float], start_s: float | None
) -> NDArray[np.float64]:
    """Return the stage times of a reference's frames [s], from `start_s` on."""
    times = (reference.time_s - clock[0]) / (1.0 + clock[1] * 1e-6)
    return times if start_s is None else times[times >= start_s]


def _missed(times_s: NDArray[np.float64], poses: Poses) -> NDArray[np.bool_]:
    """Return whether each time is further than a frame and a half from every pose."""
    after = np.clip(np.searchsorted(poses.time_s, times_s), 1, max(poses.frame_count - 1, 1))
    near = np.minimum(
        np.abs(poses.time_s[np.minimum(after, poses.frame_count - 1)] - times_s),
        np.abs(poses.time_s[after - 1] - times_s),
    )
    return near > 1.5 / poses.frames_per_second


def _inside(times_s: NDArray[np.float64], spans: Spans) -> NDArray[np.bool_]:
    inside = np.zeros(len(times_s), dtype=bool)
    for begin, end in spans:
        inside |= (times_s >= begin) & (times_s <= end)
    return inside


def _switches(
    poses: Poses,
    references: Mapping[str, Reference],
    clocks: Mapping[str, tuple[float, float]],
    start_s: float | None,
    alignment: Alignment,
) -> int:
    """Return the number of changes of a performer's nearest reference."""
    times = poses.time_s if start_s is None else poses.time_s[poses.time_s >= start_s]
    far = np.full((len(references), len(times)), np.inf)
    for row, (name, reference) in enumerate(references.items()):
        offset_s, drift_ppm = clocks[name]
        matched = match(poses, reference, start_s=start_s, offset_s=offset_s, drift_ppm=drift_ppm)
        solve, truth = replace(matched, solve_m=alignment.to_reference(matched.solve_m)).pick(matched.joints)
        apart = np.linalg.norm(solve - truth, axis=2)
        known = np.isfinite(apart)
        mean = np.where(known, apart, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
        at = np.searchsorted(times, matched.time_s)
        far[row, at] = np.where(known.any(axis=1), mean, np.inf)
    shown = np.isfinite(far).all(axis=0)
    nearest, rate_hz = far[:, shown].argmin(axis=0), poses.frames_per_second
    edges = np.flatnonzero(np.diff(nearest)) + 1
    stays = [part[0] for part in np.split(nearest, edges) if len(part) >= _LEAST_STAY_S * rate_hz]
    return int(np.count_nonzero(np.diff(stays))) if len(stays) else 0

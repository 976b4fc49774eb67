"""The solve of several performers' takes: each for itself, then finishing keeps them apart from one another."""

from collections.abc import Sequence

from studio.engine.model.poses import Poses
from studio.engine.whole_take.finisher import Finisher
from studio.engine.whole_take.take import TakeSolve

STEPS_BESIDE = 3
"""Steps in which performers make room for one another, or take hands."""


def solve_together(solves: Sequence[TakeSolve]) -> list[Poses]:
    """Return the poses of each performer.

    Raises:
        TakeError: a performer has no frame.
        CalibrationError, SettingsError: see `Pipeline`.
    """
    for solve in solves:
        solve.first()
    finishing = [(solve, solve.finisher) for solve in solves if solve.finisher is not None]
    finishers = [finisher for _, finisher in finishing if finisher.has_results]
    if len(finishers) > 1:
        for solve, finisher in finishing:
            if finisher.has_results:
                finisher.refine(solve.finishing_progress(), beside=STEPS_BESIDE)
        keep_apart(finishers)
        stand_together(finishers)
    first_floor = sorted(solves, key=lambda solve: solve.finisher is not None and solve.finisher.floor_given)
    poses = {id(solve): solve.poses() for solve in first_floor}  # whose feet placed the floor comes first
    return [poses[id(solve)] for solve in solves]


def keep_apart(finishers: Sequence[Finisher]) -> None:
    """Make room between refined performers."""
    for _ in range(STEPS_BESIDE):
        surfaces = [finisher.surfaces() for finisher in finishers]
        for k, finisher in enumerate(finishers):
            finisher.step_beside(surfaces[k], surfaces[:k] + surfaces[k + 1 :])


def stand_together(finishers: Sequence[Finisher]) -> None:
    """Raise all as far as the first whose feet placed the floor: what lies between them stays as it is."""
    first = next((finisher for finisher in finishers if not finisher.floor_given), None)
    for finisher in finishers:
        if first is not None and finisher is not first:
            finisher.stand_beside(first)

"""The solve of several performers' takes: each by itself, then finishing keeps them apart from one another."""

from collections.abc import Mapping, Sequence

from studio.engine.model.poses import Poses
from studio.engine.whole_take.finish.contact.between import held_by_others
from studio.engine.whole_take.finisher import Finisher
from studio.engine.whole_take.take import TakeSolve

STEPS_BESIDE = 3
"""Steps in which performers make room for one another, or take hands."""


def solve_together(solves: Mapping[str, TakeSolve]) -> dict[str, Poses]:
    """Return the poses of each performer.

    Args:
        solves: by performer, `performer_1`, ...

    Raises:
        TakeError: a performer has no frame.
        CalibrationError, SettingsError: see `Pipeline`.
    """
    for solve in solves.values():
        solve.first()
    finishers = {
        name: solve.finisher
        for name, solve in solves.items()
        if solve.finisher is not None and solve.finisher.has_results
    }
    if len(finishers) > 1:
        for name, finisher in finishers.items():
            finisher.refine(solves[name].finishing_progress(), beside=STEPS_BESIDE)
        keep_apart(finishers)
        stand_together([*finishers.values()])

    def has_given_floor(name: str) -> bool:
        finisher = solves[name].finisher
        return finisher is not None and finisher.floor_given

    # performers whose feet placed the floor come first
    poses = {name: solves[name].poses() for name in sorted(solves, key=has_given_floor)}
    return {name: poses[name] for name in solves}


def keep_apart(finishers: Mapping[str, Finisher]) -> None:
    """Make room between refined performers, and bring together the joints that an operator says touch."""
    touches = {name: one.touches for name, one in finishers.items() if one.touches is not None}
    for _ in range(STEPS_BESIDE):
        surfaces = {name: finisher.surfaces() for name, finisher in finishers.items()}
        for name, finisher in finishers.items():
            others = {other: one for other, one in surfaces.items() if other != name}
            held = held_by_others(name, surfaces, touches)
            finisher.step_beside(surfaces[name], [*others.values()], held)


def stand_together(finishers: Sequence[Finisher]) -> None:
    """Raise all as far as the first one whose feet placed the floor; their relative places do not change."""
    first = next((finisher for finisher in finishers if not finisher.floor_given), None)
    for finisher in finishers:
        if first is not None and finisher is not first:
            finisher.stand_beside(first)

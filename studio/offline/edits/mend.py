"""Automatic mending of a take: the offered edits of all its clean-up events are tried; those that mend are kept."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import msgspec

from studio.engine.edits.edit import Edit, RetimeEdit
from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.offline.edits.applying import apply_offers
from studio.offline.edits.offers import offers
from studio.offline.replay import solved_with
from studio.take.edits.carry import carried
from studio.take.edits.change import change_edits
from studio.take.edits.kept import read_edits
from studio.take.folder.solves import Solved
from studio.take.folder.take import Take

_MOST_SOLVES = 12
"""Number of solves that the progress assumes; few takes need more."""


@dataclass(frozen=True)
class Mended:
    """What was mended.

    Attributes:
        edits: those that the take was given.
        before: number of clean-up events without them, of all performers.
        after: the same with them.
    """

    edits: tuple[Edit, ...]
    before: int
    after: int


def mend(take: Take, settings: SolveSettings, *, progress: Callable[[float], None] | None = None) -> Mended:
    """Give a take the offered edits that remove their clean-up events, make no other and move nothing else.

    They are one change of its edits: one undo takes them back. The take is solved several times; no solve is written.

    Args:
        take: with raw frames.
        settings: of the solve that is mended.
        progress: receives the share done, an estimate.

    Raises:
        FormatError: its list of edits cannot be read.
        TakeError, CalibrationError, SettingsError: as `solve_take`.
    """
    kept = carried(take, read_edits(take))[0].edits
    given = [
        one for one in kept if one.on and not isinstance(one, RetimeEdit)
    ]  # events and edits in stage time
    start_s, done = take.meta["calibration_s"], 0

    def solved(edits: Sequence[Edit]) -> dict[str, Solved]:
        nonlocal done
        found = solved_with(take, settings, [*given, *edits])
        done += 1
        if progress is not None:
            progress(min(done / _MOST_SOLVES, 1.0))
        return found

    def count(found: Iterable[Poses]) -> int:
        return sum(len(solve_cleanup(one, start_s=start_s)["cleanup_events"] or []) for one in found)

    first = solved(())
    made: list[Edit] = []
    after = {performer: one.poses for performer, one in first.items()}
    for performer in first:
        before = (solved(made) if made else first)[performer]
        if before.trace is None:
            continue

        def poses(
            edits: Sequence[Edit], who: str = performer, others: tuple[Edit, ...] = tuple(made)
        ) -> Poses:
            return solved([*others, *edits])[who].poses

        found = offers(before.poses, before.trace, start_s=start_s, performer=performer)
        applied, after[performer] = apply_offers(found, before.poses, before.trace, poses, start_s=start_s)
        made += applied
    if made and len(first) > 1:  # edits of one performer may move another
        after = {performer: one.poses for performer, one in solved(made).items()}
    new = tuple(msgspec.structs.replace(edit, id="") for edit in made)
    if new:
        change_edits(take, new)
    if progress is not None:
        progress(1.0)
    return Mended(new, count(one.poses for one in first.values()), count(after.values()))

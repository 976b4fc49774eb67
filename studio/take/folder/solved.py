"""The performers of a solve, with their poses."""

from dataclasses import dataclass

from studio.engine.model.poses import Poses
from studio.take.folder.performers import performer_by_name, performer_number, shown_name
from studio.take.folder.solves import undecided_spans
from studio.take.folder.take import PERFORMER, POSES, Take


@dataclass(frozen=True)
class SolvedPerformer:
    """A performer of a solve.

    Attributes:
        performer: `performer_1`, ... in order of entry.
        name: the operator's name for them, else as `performer`; "" for a single performer.
        poses: in the stage frame, from their entry on.
        undecided_s: spans of stage time [s] in which they were not told apart from another; None for a single
            performer.
    """

    performer: str
    name: str
    poses: Poses
    undecided_s: tuple[tuple[float, float], ...] | None

    @property
    def number(self) -> int:
        """Their number, from 1."""
        return performer_number(self.performer)


def solved_performers(take: Take, solve: str, only: str | None = None) -> list[SolvedPerformer]:
    """Return the performers of a solve in order of entry; with `only`, the one of this name.

    Raises:
        TakeError: no such performer.
        FormatError: there is no such solve, or it is damaged.
    """
    names = take.performer_names(solve)
    if only is not None:
        take.performer_folder(solve, only)  # reports a missing performer
        names = [performer_by_name(take.meta, only)] if names else []
    if not names:
        return [SolvedPerformer(PERFORMER, "", Poses.load(take.solve_folder(solve) / POSES), None)]
    found = []
    for performer in names:
        folder = take.performer_folder(solve, performer)
        poses, doubts = Poses.load(folder / POSES), tuple(undecided_spans(folder))
        found.append(SolvedPerformer(performer, shown_name(take.meta, performer), poses, doubts))
    return found

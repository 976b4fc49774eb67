"""Performers whose motion a target receives, and their names."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from studio.engine.model.calibration import Performer
from studio.engine.model.frames import StepResult


@dataclass(frozen=True)
class Member:
    """A performer: name, "" for a single performer; proportions, None before they are measured."""

    name: str
    proportions: Performer | None


Cast = Callable[[], Mapping[int, Member]]
"""Returns the performers by number; a single performer has the number 1 and no name."""


def steps_of(
    result: StepResult, cast: Mapping[int, Member], performer: str
) -> list[tuple[StepResult, Member]]:
    """Return the steps to send: those of the named performer, "" = of all; none if nobody has that name."""
    nobody = Member("", None)
    steps = [(one, cast.get(one.performer, nobody)) for one in result.each()]
    return [(one, member) for one, member in steps if performer in ("", member.name)]

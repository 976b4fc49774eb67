"""Whose motion a target receives, and what the performers are called."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from studio.engine.model.calibration import Performer
from studio.engine.model.frames import StepResult


@dataclass(frozen=True)
class Member:
    """A performer: name, "" of one who is alone; proportions, None before they are measured."""

    name: str
    proportions: Performer | None


Cast = Callable[[], Mapping[int, Member]]
"""Returns the performers by number; one who is alone has the number 1 and no name."""


def steps_of(
    result: StepResult, cast: Mapping[int, Member], performer: str
) -> list[tuple[StepResult, Member]]:
    """Return the steps to send: of the performer of that name, "" = of all; none where nobody is called so."""
    nobody = Member("", None)
    steps = [(one, cast.get(one.performer, nobody)) for one in result.each()]
    return [(one, member) for one, member in steps if performer in ("", member.name)]

"""Names of the performers on the live stage: `performer_1` and so on until they are named."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from studio.engine.base.errors import SettingsError, TakeError
from studio.engine.identity.recognised import performer_key
from studio.engine.model.calibration import Performer
from studio.take.folder.names import check_name


@dataclass(frozen=True)
class CastMember:
    """A performer as other programs are told: name, and proportions once they are measured."""

    name: str
    proportions: Performer | None


@dataclass
class Cast:
    """Names by the performer's number; a number without one has its own."""

    _names: dict[int, str] = field(default_factory=dict)

    def name(self, number: int) -> str:
        """Return what a performer is called."""
        return self._names.get(number, performer_key(number))

    def number(self, name: str, numbers: Collection[int]) -> int:
        """Return which of the performers is called so.

        Raises:
            SettingsError: none of them.
        """
        found = [number for number in numbers if self.name(number) == name]
        if not found:
            raise SettingsError(
                "performers.none",
                "no performer on the stage is called {name!r}; there are: {names}",
                name=name[:80],
                names=", ".join(self.name(number) for number in sorted(numbers)) or "none",
            )
        return found[0]

    def is_taken(self, name: str, by: Collection[int]) -> bool:
        """Whether one of these performers is called so, whatever the case of letters: names are those of folders."""
        return name.casefold() in {self.name(number).casefold() for number in by}

    def rename(self, number: int, name: str, others: Collection[int]) -> None:
        """Call a performer by another name.

        Raises:
            TakeError: a name that is not allowed, or that one of the `others` has.
        """
        check_name("performer", name)
        if self.is_taken(name, others):
            raise TakeError(
                "performers.name_taken",
                "a performer on the stage is called {name!r} already; two may not have one name: choose another",
                name=name,
            )
        self._names[number] = name

    def keep(self, numbers: Collection[int]) -> None:
        """Forget the names of all other performers."""
        self._names = {number: name for number, name in self._names.items() if number in numbers}

    def given(self) -> dict[str, str]:
        """Return the names that were given, by `performer_1` and so on."""
        return {performer_key(number): name for number, name in sorted(self._names.items())}

    def restore(self, names: Mapping[int, str]) -> None:
        """Take over names, such as those of a take that goes on."""
        self._names = dict(names)

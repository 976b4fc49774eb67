"""Names of the performers on the live stage: `performer_1` and so on until they are named."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from studio.engine.base.errors import SettingsError, TakeError
from studio.engine.identity.recognised import performer_key
from studio.engine.model.calibration import Performer
from studio.take.folder.names import check_name


@dataclass(frozen=True)
class CastMember:
    """A performer as reported to other programs: name, and proportions once they are measured."""

    name: str
    proportions: Performer | None


@dataclass
class Cast:
    """Names by the performer's number; the default is `performer_1` and so on."""

    _names: dict[int, str] = field(default_factory=dict)

    def name(self, number: int) -> str:
        """Return a performer's name."""
        return self._names.get(number, performer_key(number))

    def number(self, name: str, numbers: Collection[int]) -> int:
        """Return the number of the performer with a name.

        Raises:
            SettingsError: none of them has it.
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
        """Whether one of these performers has a name, ignoring case, because names are also folder names."""
        return name.casefold() in {self.name(number).casefold() for number in by}

    def rename(self, number: int, name: str, others: Collection[int]) -> None:
        """Rename a performer.

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
        """Use these names instead, such as those of a resumed take."""
        self._names = dict(names)

"""The types of switches. A switch has a name, type, values, a default in each preset, help and cost.

`settings` holds the table of all switches. The command line, the page, the schema of the API, `docs/switches.md` and
the live log use that table.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, TypeAlias

from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import say
from studio.engine.base.value_sentences import bad_setting
from studio.engine.model.joints import CANONICAL

SwitchKind: TypeAlias = Literal["choice", "range", "text"]


class Defaults(NamedTuple):
    """The value of a switch in each preset of the program."""

    raw: Any
    thesis: Any
    studio: Any
    finish: Any

    @classmethod
    def everywhere(cls, value: Any) -> "Defaults":
        """Return the same value for every preset."""
        return cls(value, value, value, value)


@dataclass(frozen=True)
class Switch(ABC):
    """One switch.

    Attributes:
        name: NAME in `--set NAME=VALUE`, and the field of `SolveSettings`.
        defaults: its value in each preset.
        help: its effect, one sentence.
        cost: its cost when it is on, one phrase; "" = not measurable.
        kind: kind of its values, for pages and programs.
    """

    name: str
    defaults: Defaults
    help: str
    cost: str = ""

    kind: ClassVar[SwitchKind] = "text"

    @property
    @abstractmethod
    def allowed(self) -> str:
        """The allowed values, as errors and help write them."""

    @abstractmethod
    def parse(self, text: str) -> Any:
        """Return the value of a text.

        Raises:
            SettingsError: the text is not allowed; the message lists the allowed values.
        """

    def from_json(self, value: Any) -> Any:
        """Return the value in `settings.json`, checked.

        Raises:
            SettingsError: it is not allowed.
        """
        return self.parse(value if isinstance(value, str) else str(value))

    def to_json(self, value: Any) -> Any:
        """Return a value as `settings.json` holds it."""
        return value

    def text(self, value: Any) -> str:
        """Return a value as `--set` takes it."""
        return shortest(value) if isinstance(value, float) else str(value)

    def refused(self, value: object) -> SettingsError:
        """Return the error for a value that is not allowed."""
        return SettingsError(bad_setting(self.name, value, self.allowed))


@dataclass(frozen=True)
class Choice(Switch):
    """One of a few values: all texts, or all whole numbers."""

    values: tuple[str, ...] | tuple[int, ...] = ()

    kind = "choice"

    @property
    def allowed(self) -> str:
        return ", ".join(str(value) for value in self.values)

    def parse(self, text: str) -> str | int:
        for value in self.values:
            if text == str(value):
                return value
        raise self.refused(text)


@dataclass(frozen=True)
class Number(Switch):
    """A number from `low` to `high`."""

    low: float = 0.0
    high: float = 1.0

    kind = "range"

    @property
    def allowed(self) -> str:
        return between(self.low, self.high)

    def parse(self, text: str) -> float:
        return number(self.name, text, self.low, self.high)

    def from_json(self, value: Any) -> float:
        return number(self.name, value, self.low, self.high)


@dataclass(frozen=True)
class Percent(Switch):
    """`off`, or per cent; the value is the text."""

    @property
    def allowed(self) -> str:
        return say("settings.off_or", "off, or {allowed}", allowed=between(0.0, 100.0))

    def parse(self, text: str) -> str:
        if text != "off":
            number(f"{self.name} (off, or per cent)", text, 0.0, 100.0)
        return text


@dataclass(frozen=True)
class Names(Switch):
    """`all`, or names separated by commas; the value is the text."""

    @property
    def allowed(self) -> str:
        return say("settings.camera_names", "all, or camera names separated by commas")

    def parse(self, text: str) -> str:
        if not text.strip():
            raise self.refused("")
        return text


@dataclass(frozen=True)
class Point(Switch):
    """A point on the stage [m], `x,y,z`."""

    limit_m = 1000.0

    @property
    def allowed(self) -> str:
        return say("settings.point", "x,y,z in metres")

    def parse(self, text: str) -> tuple[float, float, float]:
        return self.from_json(text.split(","))

    def from_json(self, value: Any) -> tuple[float, float, float]:
        if not isinstance(value, (list, tuple)) or len(value) != 3:
            raise self.refused(value if isinstance(value, str) else ",".join(map(str, value)))
        x, y, z = (number(self.name, part, -self.limit_m, self.limit_m) for part in value)
        return x, y, z

    def to_json(self, value: tuple[float, float, float]) -> list[float]:
        return list(value)

    def text(self, value: tuple[float, float, float]) -> str:
        return ",".join(shortest(part) for part in value)


@dataclass(frozen=True)
class Effector:
    """Effector settings of one joint, as in HumanIK: weight of its target (`reach`), share of influence on the rest
    of the chain (`pull`), resistance to being moved by others (`resist`); each 0..1.
    """

    reach: float = 1.0
    pull: float = 1.0
    resist: float = 0.0


ByJoint: TypeAlias = dict[str, float] | dict[str, Effector]
"""A number, or an `Effector`, by canonical joint."""


@dataclass(frozen=True)
class PerJoint(Switch):
    """Numbers by canonical joint, set one at a time: `NAME.<joint>=VALUE`."""

    low: float = 0.0
    high: float = 1.0

    written = ("displacement_limits_m_s.<joint>",)

    @property
    def allowed(self) -> str:
        return between(self.low, self.high)

    def parse(self, text: str) -> Any:
        raise SettingsError(
            "settings.by_joint",
            "{key} is set joint by joint; allowed: {allowed}",
            key=self.name,
            allowed=[*self.written],
        )

    def parse_part(self, value: Mapping[str, Any], key: str, rest: list[str], given: Any) -> ByJoint:
        """Return the value with one number changed; `rest` is the part of `key` after the switch's name.

        Raises:
            SettingsError: an unknown joint, or a number that is not allowed.
        """
        if len(rest) != 1:
            raise unknown_part(key)
        return {**value, joint(key, rest[0]): number(key, given, self.low, self.high)}

    def from_json(self, value: Any) -> ByJoint:
        return {
            joint(f"{self.name}.{name}", name): number(f"{self.name}.{name}", one, self.low, self.high)
            for name, one in value.items()
        }

    def to_json(self, value: Mapping[str, Any]) -> dict[str, float] | dict[str, dict[str, float]]:
        return dict(value)

    def texts(self, value: Mapping[str, Any]) -> dict[str, str]:
        """Return the value as the keys and texts of `--set`."""
        return {f"{self.name}.{name}": shortest(one) for name, one in value.items()}


@dataclass(frozen=True)
class Effectors(PerJoint):
    """An `Effector` by canonical joint, set one number at a time: `NAME.<joint>.reach=VALUE`."""

    written = ("effectors.<joint>.reach", ".pull", ".resist")

    def parse_part(
        self, value: Mapping[str, Any], key: str, rest: list[str], given: Any
    ) -> dict[str, Effector]:
        if len(rest) != 2 or rest[1] not in vars(Effector()):
            raise unknown_part(key)
        name = joint(key, rest[0])
        numbers = {**vars(value[name]), rest[1]: number(key, given, self.low, self.high)}
        return {**value, name: Effector(**numbers)}

    def from_json(self, value: Any) -> dict[str, Effector]:
        out = dict(self.defaults.studio)
        for name, numbers in value.items():
            for part, one in numbers.items():
                out = self.parse_part(out, f"{self.name}.{name}.{part}", [name, part], one)
        return out

    def to_json(self, value: Mapping[str, Any]) -> dict[str, dict[str, float]]:
        return {name: vars(effector).copy() for name, effector in value.items()}

    def texts(self, value: Mapping[str, Any]) -> dict[str, str]:
        return {
            f"{self.name}.{name}.{part}": shortest(one)
            for name, effector in value.items()
            for part, one in vars(effector).items()
        }


def unknown_part(key: str) -> SettingsError:
    """Return the error for a key below a switch that has no such part."""
    return SettingsError(
        "settings.unknown_part",
        "unknown setting {key!r}; allowed: effectors.<joint>.reach, .pull or .resist, "
        "displacement_limits_m_s.<joint>",
        key=key,
    )


def joint(key: str, name: str) -> str:
    """Return the name of a canonical joint.

    Raises:
        SettingsError: there is no such joint.
    """
    if name not in CANONICAL:
        raise SettingsError(
            "settings.unknown_joint",
            "{key}: unknown joint {joint!r}; allowed: {allowed}",
            key=key,
            joint=name,
            allowed=[*CANONICAL],
        )
    return name


def number(key: str, value: Any, low: float, high: float) -> float:
    """Return a number from a text or from JSON.

    Raises:
        SettingsError: it is no number, or not from `low` to `high`.
    """
    try:
        read = float(value)
    except (TypeError, ValueError):
        read = float("nan")
    if not low <= read <= high:
        raise SettingsError(bad_setting(key, value, between(low, high)))
    return read


def between(low: float, high: float) -> str:
    """Return a range as errors and help write it."""
    return say("settings.between", "a number from {low:g} to {high:g}", low=low, high=high)


def shortest(value: float) -> str:
    """Return the shortest text that reads back as this number."""
    return f"{value:g}" if float(f"{value:g}") == value else str(value)

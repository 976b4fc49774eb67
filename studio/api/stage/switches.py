"""The switches of a solve for the page: values, explanations, presets, differences."""

from typing import Any

from msgspec import UNSET, Struct, UnsetType

from studio.engine.model.settings.settings import SWITCHES, SolveSettings
from studio.engine.model.settings.switches import Choice, Number, PerJoint, Switch, SwitchKind, shortest
from studio.take.library.presets import Presets


class ListedSwitch(Struct):
    """A single-valued switch: what it does, what it costs where it is on, its values, its default as text.

    A choice has `values`, a range `low` and `high`.
    """

    key: str
    help: str
    cost: str
    kind: SwitchKind
    default: str
    values: tuple[str, ...] | UnsetType = UNSET
    low: float | UnsetType = UNSET
    high: float | UnsetType = UNSET


class Catalogue(Struct):
    """Every single-valued switch, and every preset as texts by key; `saved` names those that can be changed."""

    switches: list[ListedSwitch]
    presets: dict[str, dict[str, str]]
    saved: list[str]


class SettingsInUse(Struct):
    """Settings: the nearest of some presets, the differences from it, and every switch, as texts by key."""

    preset: str
    set: dict[str, str]
    switches: dict[str, str]


def catalogue(presets: Presets) -> Catalogue:
    """Return every single-valued switch, and every preset."""
    switches = [_listed(switch) for switch in SWITCHES.values() if not isinstance(switch, PerJoint)]
    by_name = {name: value.texts() for name, value in presets.all().items()}
    return Catalogue(switches, by_name, list(presets.saved()))


def _listed(switch: Switch) -> ListedSwitch:
    default = switch.text(switch.defaults.studio)
    listed = ListedSwitch(switch.name, switch.help, switch.cost, switch.kind, default)
    if isinstance(switch, Choice):
        listed.values = tuple(str(value) for value in switch.values)
    if isinstance(switch, Number):
        listed.low, listed.high = switch.low, switch.high
    return listed


def describe(settings: SolveSettings, presets: dict[str, SolveSettings]) -> SettingsInUse:
    """Return settings as the nearest of some presets and differences."""
    mine = settings.texts() | settings.texts_by_joint()
    differences = {}
    for name, value in presets.items():
        base = value.texts() | value.texts_by_joint()
        differences[name] = {key: text for key, text in mine.items() if base.get(key) != text}
    nearest = min(differences, key=lambda name: len(differences[name]))
    return SettingsInUse(nearest, differences[nearest], settings.texts())


def from_request(presets: Presets, preset: str, changes: dict[str, Any]) -> SolveSettings:
    """Return a preset's settings with changes by key.

    Raises:
        SettingsError: an unknown preset, key or value.
    """
    return presets.settings(preset, assignments(changes))


def assignments(changes: dict[str, Any]) -> list[str]:
    """Return changes by key as the command line's `KEY=VALUE`."""
    return [f"{key}={_written(value)}" for key, value in changes.items()]


def _written(value: Any) -> str:
    if isinstance(value, list):
        return ",".join(_written(item) for item in value)
    return shortest(value) if isinstance(value, float) else str(value)

"""The switches of a solve for the page: values, explanations, presets, differences."""

from typing import Any

from studio.engine.model.settings import SWITCHES, SolveSettings
from studio.engine.model.switches import PerJoint, shortest
from studio.take.library.presets import Presets


def catalogue(presets: Presets) -> dict[str, Any]:
    """Return every single-valued switch, and every preset.

    `switches`: `key`, `kind` (choice, range, text), `help`, `cost`, `default` (as text), and for a choice `values`,
    for a range `low` and `high`. `presets`: text by key, by name; `saved`: the names of those that can be changed.
    """
    switches = [
        {"key": switch.name, "help": switch.help, "cost": switch.cost, **switch.schema()}
        | {"default": switch.text(switch.defaults.studio)}
        for switch in SWITCHES.values()
        if not isinstance(switch, PerJoint)
    ]
    by_name = {name: value.texts() for name, value in presets.all().items()}
    return {"switches": switches, "presets": by_name, "saved": list(presets.saved())}


def describe(settings: SolveSettings, presets: dict[str, SolveSettings]) -> dict[str, Any]:
    """Return settings as the nearest of some presets and differences: `preset`, `set`; `switches`, all as text."""
    mine = settings.texts() | settings.texts_by_joint()
    differences = {}
    for name, value in presets.items():
        base = value.texts() | value.texts_by_joint()
        differences[name] = {key: text for key, text in mine.items() if base.get(key) != text}
    nearest = min(differences, key=lambda name: len(differences[name]))
    return {"preset": nearest, "set": differences[nearest], "switches": settings.texts()}


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

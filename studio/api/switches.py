"""The switches of a solve as the page shows them: values, explanations, presets, differences."""

from typing import Any

from studio.engine.settings import CHOICES, EXPLANATIONS, RANGES, SolveSettings
from studio.take.presets import Presets

_NESTED = ("effectors", "displacement_limits_m_s")


def catalogue(presets: Presets) -> dict[str, Any]:
    """Return every switch and every preset.

    `switches`: `key`, `kind` (choice, range, text), `help`, `default` (as text), and for a choice `values`, for a
    range `low` and `high`. `presets`: text by key, by name; `saved`: the names of those that can be changed.
    """
    defaults = texts(SolveSettings())
    switches = []
    for key, help_text in EXPLANATIONS.items():
        if key in _NESTED:
            continue
        item: dict[str, Any] = {"key": key, "help": help_text, "default": defaults[key]}
        if key in CHOICES:
            item |= {"kind": "choice", "values": list(CHOICES[key])}
        elif key in RANGES:
            low, high = RANGES[key]
            item |= {"kind": "range", "low": low, "high": high}
        else:
            item |= {"kind": "text"}
        switches.append(item)
    by_name = {name: texts(value) for name, value in presets.all().items()}
    return {"switches": switches, "presets": by_name, "saved": list(presets.saved())}


def texts(settings: SolveSettings, *, nested: bool = False) -> dict[str, str]:
    """Return the switches as `--set KEY=VALUE` writes them; with `nested`, those per joint too."""
    value = settings.to_json()
    out = {key: _text(item) for key, item in value.items() if key not in _NESTED}
    if nested:
        for joint, effector in value["effectors"].items():
            out |= {f"effectors.{joint}.{name}": _text(number) for name, number in effector.items()}
        limits = value["displacement_limits_m_s"]
        out |= {f"displacement_limits_m_s.{joint}": _text(number) for joint, number in limits.items()}
    return out


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ",".join(_text(item) for item in value)
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def describe(settings: SolveSettings, presets: dict[str, SolveSettings]) -> dict[str, Any]:
    """Return settings as the nearest of some presets and what differs: `preset`, `set`; `switches`, all as text."""
    mine = texts(settings, nested=True)
    differences = {}
    for name, value in presets.items():
        base = texts(value, nested=True)
        differences[name] = {key: text for key, text in mine.items() if base.get(key) != text}
    nearest = min(differences, key=lambda name: len(differences[name]))
    return {"preset": nearest, "set": differences[nearest], "switches": texts(settings)}


def from_request(presets: Presets, preset: str, changes: dict[str, Any]) -> SolveSettings:
    """Return a preset's settings with changes by key.

    Raises:
        SettingsError: an unknown preset, key or value.
    """
    return presets.settings(preset, assignments(changes))


def assignments(changes: dict[str, Any]) -> list[str]:
    """Return changes by key as the command line writes them, `KEY=VALUE`."""
    return [f"{key}={_text(value)}" for key, value in changes.items()]

"""The values of switches that tests go through."""

from studio.engine.model.settings.settings import SWITCHES
from studio.engine.model.settings.switches import Choice, Number

CHOICES = {
    s.name: tuple(str(value) for value in s.values) for s in SWITCHES.values() if isinstance(s, Choice)
}
"""Switches with a fixed list of values, as `--set` writes them."""

RANGES = {s.name: (s.low, s.high) for s in SWITCHES.values() if isinstance(s, Number)}
"""Switches that are a number, with their minimum and maximum."""

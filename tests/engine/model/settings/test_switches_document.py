"""`docs/switches.md` names every switch, value and default, and no others."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from studio.engine.model.settings.settings import PRESETS, SWITCHES, SolveSettings
from studio.engine.solve.conditioning.displacement import DEFAULT_M_S
from tests.engine.switch_values import CHOICES, RANGES

TEXT = (Path(__file__).parents[4] / "docs" / "switches.md").read_text(encoding="utf-8")
KEYS = [f.name for f in fields(SolveSettings)]
SECTIONS = dict(re.findall(r"^### `(\w+)`\n(.*?)(?=^##|\Z)", TEXT, re.MULTILINE | re.DOTALL))


def rows(text):
    """Cells of a Markdown table's rows, without its header."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


HEAD, _, *DEFAULTS = rows(TEXT.split("## Defaults")[1].split("\n## ")[0])


def as_written(value):
    """A setting as the table writes it."""
    if isinstance(value, tuple):
        return ",".join(f"{number:g}" for number in value)
    return value if isinstance(value, str) else f"{value:g}"


def by_joint(section, default):
    """Numbers by joint of a section's table: `elbow, hand` names both sides alike, `all others` the rest."""
    given = {name: float(number) for names, number in rows(section)[2:] for name in re.findall(r"\w+", names)}
    rest = given["others"]
    return {name: given.get(name.split("_")[-1], rest) for name in default}


def test_every_switch_has_a_section_and_a_row_and_there_are_no_others():
    assert sorted(SECTIONS) == sorted(KEYS)
    assert [row[0].strip("`") for row in DEFAULTS] == KEYS


@pytest.mark.parametrize(("key", "values"), CHOICES.items())
def test_every_value_is_named(key, values):
    for value in values:
        assert f"`{value}`" in SECTIONS[key], f"{key}={value}"
    named = set(re.findall(r"`([\w:]+)`", SECTIONS[key])) - set(KEYS)
    assert named - set(values) <= {"before", "robust", "mean"}


@pytest.mark.parametrize(("key", "ends"), RANGES.items())
def test_every_range_is_named(key, ends):
    assert "{:g} to {:g}".format(*ends) in SECTIONS[key]


def test_every_cost_stands_with_its_switch():
    for switch in SWITCHES.values():
        assert switch.cost in " ".join(SECTIONS[switch.name].split()), switch.name


@pytest.mark.parametrize("preset", PRESETS)
def test_every_presets_values_are_right(preset):
    column = HEAD.index(f"`{preset}`")
    for row in DEFAULTS:
        key, value = row[0].strip("`"), getattr(PRESETS[preset], row[0].strip("`"))
        expected = "-" if isinstance(value, dict) else as_written(value)
        assert row[column] == expected, f"{key} of preset {preset}"


def test_numbers_by_joint_are_right():
    for settings in PRESETS.values():
        reach = {name: effector.reach for name, effector in settings.effectors.items()}
        assert by_joint(SECTIONS["effectors"], reach) == pytest.approx(reach)
        assert {(e.pull, e.resist) for e in settings.effectors.values()} == {(1.0, 0.0)}
        assert settings.displacement_limits_m_s == {}
    assert by_joint(SECTIONS["displacement_limits_m_s"], DEFAULT_M_S) == pytest.approx(DEFAULT_M_S)

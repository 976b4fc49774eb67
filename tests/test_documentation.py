"""Every command, option, setting, exporter, source and task of the guide is in the documentation."""

import argparse
import re
from pathlib import Path

import pytest

from studio.__main__ import COMMANDS, make_parser
from studio.camera.sources.registry import SOURCES
from studio.engine.animation.clip.options import TARGETS
from studio.engine.animation.export import EXPORTERS
from studio.engine.model.settings.settings import PRESETS, SWITCHES

ROOT = Path(__file__).parents[1]
DOCS = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in ROOT.glob("docs/**/*.md")
}
DOCS |= {
    name: (ROOT / name).read_text(encoding="utf-8")
    for name in ("README.md", "CONTRIBUTING.md", "ARCHITECTURE.md")
}
EVERYTHING = "\n".join(DOCS.values())
TASKS = ("cameras", "calibrate", "record", "compare", "export", "stream")


def subcommands() -> dict[str, argparse.ArgumentParser]:
    actions = make_parser()._actions
    return next(action.choices for action in actions if isinstance(action, argparse._SubParsersAction))


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_in_the_readme(command):
    assert f"| `{command}` |" in DOCS["README.md"]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_explains_itself(command):
    """Options are documented where they are typed: each has its words in `--help`."""
    for action in subcommands()[command]._actions:
        assert action.help, f"{command} {action.option_strings or action.dest}"


def test_every_setting_preset_exporter_target_and_source_is_documented():
    for key in SWITCHES:
        assert f"`{key}" in DOCS["docs/switches.md"], key
    for name in PRESETS:
        assert f"`{name}`" in EVERYTHING, name
    for name in EXPORTERS:
        assert f"`{name}`" in DOCS["docs/formats.md"] or f"| {name} " in DOCS["docs/export.md"], name
    for name in TARGETS:
        assert f"| `{name}` |" in DOCS["docs/export.md"], name
    for name, kind in SOURCES.items():
        assert f"| `{name}" in DOCS["docs/devices.md"], name
        assert f"`{kind.config().__name__}`" in DOCS["docs/devices.md"], name


@pytest.mark.parametrize("task", TASKS)
def test_the_guide_has_every_task(task):
    assert f"({task}.md)" in DOCS["docs/guide/README.md"] and f"docs/guide/{task}.md" in DOCS


def test_the_guide_exports_to_every_program():
    for program in ("Blender", "Unity", "Unreal Engine", "Maya", "MotionBuilder"):
        assert f"## {program}\n" in DOCS["docs/guide/export.md"]


@pytest.mark.parametrize("name", [name for name in DOCS if name.startswith("docs/")])
def test_every_page_is_reached(name):
    others = "\n".join(text for other, text in DOCS.items() if other != name)
    assert Path(name).name in others, name


@pytest.mark.parametrize("name", [name for name in DOCS if name.startswith(("docs/guide", "README"))])
def test_commands_in_the_guide_are_right(name):
    """Every `studio ...` line parses: no option that has gone, no value that is not allowed."""
    parser = make_parser()
    for line in re.findall(r"^ {4,}(studio .+)$", DOCS[name], re.M):
        words = re.split(r"\s+#", line)[0].split()[1:]
        if words and words[0] in COMMANDS and "..." not in line:
            try:
                parser.parse_args(spread(words))
            except SystemExit:
                pytest.fail(f"{name}: {line}")


def spread(words: list[str]) -> list[str]:
    from studio.commands.common import spread_settings

    return spread_settings(words)

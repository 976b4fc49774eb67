"""`import studio`: what is public is there, documented, and loads nothing before it is asked for."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import studio
from tests.refused import refused

STUB = Path(studio.__file__).with_suffix(".pyi")


def stub_names() -> set[str]:
    """Every name that the stub imports."""
    tree = ast.parse(STUB.read_text(encoding="utf-8"))
    return {alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}


def test_what_the_stub_lists_is_public_and_there():
    text = STUB.read_text(encoding="utf-8")
    (listed,) = [
        ast.literal_eval(node.value)
        for node in ast.parse(text).body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
    ]
    assert set(listed) == stub_names() == set(studio.__all__)
    for name in listed:
        assert getattr(studio, name) is not None


@pytest.mark.parametrize("name", sorted(stub_names()))
def test_every_public_function_and_class_is_documented(name):
    value = getattr(studio, name)
    if not callable(value):
        return
    text = inspect.getdoc(value) or ""
    assert len(text) > 20
    if inspect.isfunction(value) and len(inspect.signature(value).parameters) > 1 and "rais" in text.lower():
        assert "Raises:" in text


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = studio.nonsense  # type: ignore[attr-defined]


def test_importing_the_studio_loads_none_of_its_parts():
    code = "import sys, studio; print(*(m for m in sys.modules if m == 'numpy' or m.startswith('studio.')))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.split() == []


def test_the_version_is_that_of_the_package():
    parts = studio.__version__.split(".")
    assert len(parts) >= 3 and parts[0].isdigit()


def test_settings_are_made_of_switches():
    settings = studio.settings("raw", {"smoothing": "one_euro:before", "effectors.head.reach": 0.5})
    assert settings.smoothing == "one_euro:before"
    assert settings.effectors["head"].reach == 0.5
    assert settings.fusion == "mean"
    with refused(studio.SettingsError, "settings.value", allowed="mean, robust"):
        studio.settings("raw", {"fusion": "magic"})


def test_a_folder_without_a_take_is_told(tmp_path):
    with refused(studio.TakeError, "take.no_take_json", path=str(tmp_path)):
        studio.open_take(tmp_path)

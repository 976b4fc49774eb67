"""The configuration: which source wins, and what is refused."""

import json
import logging
from dataclasses import fields
from pathlib import Path

import pytest

from studio.__main__ import make_parser
from studio.commands.stage.camera import chosen_token
from studio.engine.base.errors import SettingsError
from studio.server.config import Config, effective, read_token
from studio.server.logs import JsonLines
from tests.refused import refused


def test_flags_win_over_environment_over_file_over_defaults(tmp_path: Path) -> None:
    (tmp_path / "studio.toml").write_text('host = "10.0.0.1"\nport = 1\nsessions = "~/takes"\n')
    found = effective({"port": 3, "host": None}, {"STUDIO_PORT": "2", "STUDIO_LOG_FORMAT": "json"}, tmp_path)
    assert found.config == Config("10.0.0.1", 3, Path("~/takes").expanduser(), log_format="json")
    assert found.sources["host"] == found.sources["sessions"] == str(tmp_path / "studio.toml")
    assert (found.sources["port"], found.sources["log_format"]) == ("flag", "STUDIO_LOG_FORMAT")
    assert found.sources["tls_cert"] == "default"


def test_a_file_elsewhere_is_named_by_the_environment(tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text("port = 9")
    assert effective({}, {"STUDIO_CONFIG": str(tmp_path / "other.toml")}, tmp_path).config.port == 9
    with refused(SettingsError, "config.none"):
        effective({}, {"STUDIO_CONFIG": str(tmp_path / "nothing.toml")}, tmp_path)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("prot = 1", "config.unknown_key"),
        ("port = 70000", "config.port"),
        ("port = true", "config.no_number"),
        ("port", "config.not_toml"),
        ("host = 3", "config.no_text"),
        ('log_format = "xml"', "settings.value"),
        ('tls_cert = "a"', "config.certificate_and_key"),
    ],
)
def test_wrong_files_are_refused(tmp_path: Path, text: str, code: str) -> None:
    (tmp_path / "studio.toml").write_text(text)
    with refused(SettingsError, code):
        effective({}, {}, tmp_path)


def test_a_log_line_is_json_with_the_error() -> None:
    try:
        raise ValueError("no")
    except ValueError as error:
        record = logging.LogRecord(
            "studio.live", logging.ERROR, "", 0, "take %s", ("one",), (ValueError, error, None)
        )
    line = json.loads(JsonLines().format(record))
    assert line["message"] == "take one" and line["level"] == "error" and "ValueError: no" in line["error"]


def test_every_key_is_in_the_document() -> None:
    text = (Path(__file__).parents[1] / "docs" / "configuration.md").read_text(encoding="utf-8")
    for one in fields(Config):
        for word in (f"`{one.name}`", f"`STUDIO_{one.name.upper()}`", f"`--{one.name.replace('_', '-')}`"):
            assert word in text, word


@pytest.mark.parametrize("text", ["", "short", "with space in it though", "é" * 20, "a\tb" * 10])
def test_files_without_a_token_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "token").write_text(text, encoding="utf-8")
    with refused(SettingsError, "config.no_token"):
        read_token(tmp_path / "token", "camera_token_file")
    with refused(SettingsError, "config.token_unreadable"):
        read_token(tmp_path / "nothing", "camera_token_file")


def test_where_a_cameras_token_comes_from(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).write_text(f"{name * 20}\n")
    environment = {"STUDIO_CAMERA_TOKEN": "c" * 20, "STUDIO_CAMERA_TOKEN_FILE": str(tmp_path / "b")}
    options = ["camera", "--source", "simulated:0/1"]
    for more, given, right in (
        (["--token", "t"], environment, "t"),
        (["--token-file", str(tmp_path / "a")], environment, "a" * 20),
        ([], environment, "c" * 20),
        ([], {"STUDIO_CAMERA_TOKEN_FILE": str(tmp_path / "b")}, "b" * 20),
        ([], {}, ""),
    ):
        assert chosen_token(make_parser().parse_args([*options, *more]), given) == right

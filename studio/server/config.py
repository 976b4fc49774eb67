"""The configuration of the server: one typed object, with values from defaults, a file, the environment and flags.

Later sources override earlier ones, in that order. The file is TOML: the one named by `STUDIO_CONFIG`, else
`studio.toml` in the present folder. Environment variables are the fields' names in capitals after `STUDIO_`.
"""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_setting

FILE = "studio.toml"
PREFIX = "STUDIO_"
MIN_TOKEN = 16
DISCOVER = ("auto", "on", "off")
LOG_FORMATS = ("text", "json")
LOG_LEVELS = ("debug", "info", "warning", "error")


@dataclass(frozen=True)
class Config:
    """The options of `studio serve`.

    Attributes:
        host: address to listen on; port: 0 takes a free one.
        sessions: folder of the takes.
        recordings: folder whose recordings the page may open as cameras, in addition to the takes.
        tls_cert, tls_key: PEM files; both or none.
        operator_token_file, camera_token_file: files with given tokens, such as secrets of a
            container; without them the server makes its own.
        discover: whether cameras that announce themselves by mDNS are listed: `on`, `off`, or `auto` (on at a
            loopback address alone, and then on this machine alone).
        timecode, timecode_rate: source and rate of timecode until others are chosen on the page.
        log_format: `text` or `json` (a line per event); log_level: the lowest level that is logged.
    """

    host: str = "127.0.0.1"
    port: int = 8000
    sessions: Path = field(default=Path("sessions"))
    recordings: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None
    operator_token_file: Path | None = None
    camera_token_file: Path | None = None
    discover: str = "auto"
    timecode: str = "off"
    timecode_rate: str = "25"
    log_format: str = "text"
    log_level: str = "info"

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise SettingsError("config.port", "port={port} is no port; allowed: 0 to 65535", port=self.port)
        _one_of("discover", self.discover, DISCOVER)
        _one_of("log_format", self.log_format, LOG_FORMATS)
        _one_of("log_level", self.log_level, LOG_LEVELS)
        if (self.tls_cert is None) != (self.tls_key is None):
            raise SettingsError(
                "config.certificate_and_key",
                "--tls-cert and --tls-key (tls_cert, tls_key) belong together; give both, or none",
            )


def read_token(file: Path | None, name: str) -> str:
    """Return the token in a file, `name` being its key; empty if no file is named.

    Raises:
        SettingsError: the file cannot be read, or its content is too short to be a secret.
    """
    if file is None:
        return ""
    try:
        token = file.read_text(encoding="utf-8").strip()
    except (OSError, ValueError) as error:
        raise SettingsError(
            "config.token_unreadable",
            "{name}={path} cannot be read: {error}",
            name=name,
            path=file,
            error=error,
        ) from error
    if len(token) < MIN_TOKEN or not token.isascii() or not token.isprintable() or " " in token:
        raise SettingsError(
            "config.no_token",
            "{name}={path} holds no token; allowed: {least} or more letters, digits or signs "
            "without spaces, such as `openssl rand -hex 24` gives",
            name=name,
            path=file,
            least=MIN_TOKEN,
        )
    return token


def _one_of(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise SettingsError(bad_setting(name, value, allowed))


@dataclass(frozen=True)
class Effective:
    """The configuration in force, and the source of each field."""

    config: Config
    sources: dict[str, str]


def effective(flags: Mapping[str, Any], environment: Mapping[str, str], folder: Path) -> Effective:
    """Return the configuration of these flags (None = not given), this environment and the file in `folder`.

    Raises:
        SettingsError: an unknown key, a value of the wrong kind, or a file that cannot be read.
    """
    values: dict[str, Any] = {}
    sources = {one.name: "default" for one in fields(Config)}
    path = Path(environment.get(PREFIX + "CONFIG") or folder / FILE)
    layers = [
        (str(path), _read(path, named=PREFIX + "CONFIG" in environment)),
        (
            "environment",
            {n: environment[PREFIX + n.upper()] for n in sources if PREFIX + n.upper() in environment},
        ),
        ("flag", {name: value for name, value in flags.items() if value is not None}),
    ]
    for source, layer in layers:
        for name, value in layer.items():
            values[name] = _converted(name, value, source)
            sources[name] = f"{PREFIX}{name.upper()}" if source == "environment" else source
    return Effective(Config(**values), sources)


def _read(path: Path, *, named: bool) -> dict[str, Any]:
    """Return the values of a configuration file; none if there is no file and none was named."""
    if not path.is_file():
        if named:
            raise SettingsError(
                "config.none",
                "there is no configuration file {path}, which {prefix}CONFIG names",
                path=path,
                prefix=PREFIX,
            )
        return {}
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SettingsError(
            "config.not_toml", "{path} is no TOML file: {error}", path=path, error=error
        ) from error
    known = [one.name for one in fields(Config)]
    unknown = [name for name in values if name not in known]
    if unknown:
        raise SettingsError(
            "config.unknown_key",
            "{path}: unknown key {key!r}; allowed: {allowed}",
            path=path,
            key=unknown[0],
            allowed=[*known],
        )
    return values


def _converted(name: str, value: Any, source: str) -> Any:
    if name == "port":
        text = str(value)
        if isinstance(value, bool) or not (text.isascii() and text.isdigit()):
            raise SettingsError(
                "config.no_number",
                "{name}={value!r} ({source}) is no number; allowed: 0 to 65535",
                name=name,
                value=value,
                source=source,
            )
        return int(text)
    if not isinstance(value, str | os.PathLike):
        raise SettingsError(
            "config.no_text", "{name}={value!r} ({source}) is no text", name=name, value=value, source=source
        )
    if name in ("sessions", "recordings", "tls_cert", "tls_key", "operator_token_file", "camera_token_file"):
        return Path(value).expanduser()
    return str(value)

"""Settings of triggers: `sessions/triggers.json`, so that they survive a restart."""

from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec
from msgspec import Struct

from studio.engine.base.addresses import is_host
from studio.engine.base.choices import load_choices, save_choices
from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_setting
from studio.engine.base.versions import TRIGGERS
from studio.triggers.capture_xml import PORT as XML_PORT
from studio.triggers.osc import PORT as OSC_PORT

FILE = "triggers.json"
_MOST, _LONGEST = 16, 300
_MIN_TOKEN = 8


class TriggerSettings(Struct, frozen=True, forbid_unknown_fields=True):
    """Which triggers are on; all are off until they are switched on.

    Attributes:
        xml, osc, midi, xml_out, webhooks: whether each is on.
        host: address of this machine at which `xml` and `osc` listen; loopback keeps other machines out.
        xml_port, osc_port: UDP ports.
        midi_device: file of a MIDI device that gives bytes; midi_note: its note, 0 to 127.
        xml_targets: `<host>:<port>` of the receivers of `CaptureStart` and `CaptureStop`.
        webhook_urls: addresses that receive posts.
        token: token that requests must have, and that is sent along; "" = none.
    """

    xml: bool = False
    osc: bool = False
    midi: bool = False
    xml_out: bool = False
    webhooks: bool = False
    host: str = "127.0.0.1"
    xml_port: int = XML_PORT
    osc_port: int = OSC_PORT
    midi_device: str = ""
    midi_note: int = 60
    xml_targets: tuple[str, ...] = ()
    webhook_urls: tuple[str, ...] = ()
    token: str = ""

    def check(self) -> None:
        """Check the values.

        Raises:
            SettingsError: a value that is not allowed, or a trigger that is on and lacks a setting.
        """
        for name in ("xml_port", "osc_port"):
            _within(name, getattr(self, name), 1, 65_535)
        _within("midi_note", self.midi_note, 0, 127)
        if not is_host(self.host):
            raise _bad("host", self.host, "an address of this machine, such as 127.0.0.1 or 0.0.0.0")
        if self.token and (
            len(self.token) < _MIN_TOKEN or len(self.token) > _LONGEST or not self.token.isprintable()
        ):
            raise _bad("token", "...", f"none, or {_MIN_TOKEN} and more letters, digits and signs")
        for name in ("xml_targets", "webhook_urls"):
            if len(getattr(self, name)) > _MOST or any(len(one) > _LONGEST for one in getattr(self, name)):
                raise _bad(name, "...", f"up to {_MOST} of up to {_LONGEST} characters")
        self.targets()
        for url in self.webhook_urls:
            parts = urlsplit(url)
            if parts.scheme not in ("http", "https") or not parts.hostname:
                raise _bad("webhook_urls", url, "addresses such as http://192.168.1.20:5000/take")
        for name, needed in (
            ("midi", "midi_device"),
            ("xml_out", "xml_targets"),
            ("webhooks", "webhook_urls"),
        ):
            if getattr(self, name) and not getattr(self, needed):
                raise _bad(needed, "", f"something, as {name} is on")

    def targets(self) -> tuple[tuple[str, int], ...]:
        """Return `xml_targets` as hosts and ports.

        Raises:
            SettingsError: one is not of that form.
        """
        found = []
        for one in self.xml_targets:
            host, _, port = one.rpartition(":")
            if not host or not (port.isascii() and port.isdigit() and 0 < int(port) < 65_536):
                raise _bad("xml_targets", one, "<host>:<port>, such as 192.168.1.20:30")
            found.append((host, int(port)))
        return tuple(found)


def _bad(name: str, value: object, allowed: str) -> SettingsError:
    return SettingsError(bad_setting(name, value, allowed))


def _within(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise _bad(name, value, f"{low} to {high}")


def load_triggers(sessions: Path) -> TriggerSettings:
    """Return the stored settings; without a file all are off.

    Raises:
        SettingsError: the file cannot be read.
    """

    def read(value: dict[str, Any]) -> TriggerSettings:
        settings = msgspec.convert(value, TriggerSettings)
        settings.check()
        return settings

    return load_choices(sessions / FILE, TRIGGERS, read, TriggerSettings())


def save_triggers(sessions: Path, settings: TriggerSettings) -> None:
    """Store the settings.

    Raises:
        StudioError: the file cannot be written.
    """
    save_choices(sessions / FILE, TRIGGERS, msgspec.to_builtins(settings))

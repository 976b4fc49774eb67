"""All triggers of a studio: those that are on listen and send; changes take effect at once and are stored."""

import logging
import threading
from collections.abc import Callable
from pathlib import Path

from msgspec import Struct

from studio.engine.base.errors import SettingsError
from studio.triggers.capture_xml import parse_capture
from studio.triggers.command import TriggerCommand
from studio.triggers.listeners import MidiListener, TriggerStatus, UdpListener
from studio.triggers.midi_note import NoteDecoder
from studio.triggers.operator import Recorded, TriggerOperator
from studio.triggers.osc import parse_osc, state_message
from studio.triggers.settings import TriggerSettings, load_triggers, save_triggers
from studio.triggers.tellers import TriggerNews, WebhookTeller, XmlTeller

_UNKNOWN = "?"
_log = logging.getLogger(__name__)


class TriggersStatus(Struct, frozen=True):
    """The triggers by name, and why the stored ones cannot be read, or empty."""

    xml: TriggerStatus = TriggerStatus()
    osc: TriggerStatus = TriggerStatus()
    midi: TriggerStatus = TriggerStatus()
    xml_out: TriggerStatus = TriggerStatus()
    webhooks: TriggerStatus = TriggerStatus()
    problem: str = ""


class Triggers:
    """The triggers of a sessions folder; thread-safe.

    Args:
        sessions: folder in which they are stored.
        stage: the live stage.
        timecode: returns the current timecode, "" = none.
    """

    def __init__(self, sessions: Path, stage: Recorded, timecode: Callable[[], str]) -> None:
        self._sessions = sessions
        self._stage = stage
        self._timecode = timecode
        self._lock = threading.Lock()
        self._operator = TriggerOperator(stage)
        self._listeners: dict[str, UdpListener | MidiListener] = {}
        self._tellers: dict[str, XmlTeller | WebhookTeller] = {}
        self.settings, self._problem = TriggerSettings(), ""
        try:
            self._use(load_triggers(sessions))
        except SettingsError as error:
            self._problem = error.sentence
            _log.warning("%s", error)

    def change(self, settings: TriggerSettings) -> None:
        """Use and store other settings.

        Raises:
            SettingsError: they are not allowed; the previous ones stay in use.
            StudioError: the disk refuses.
        """
        settings.check()
        with self._lock:
            save_triggers(self._sessions, settings)
            self._problem = ""
            self._end()
            self._use(settings)

    def _use(self, settings: TriggerSettings) -> None:
        self.settings = settings
        self._operator.token = settings.token
        if settings.xml:
            self._listeners["xml"] = UdpListener(settings.host, settings.xml_port, self._xml)
        if settings.osc:
            self._listeners["osc"] = UdpListener(settings.host, settings.osc_port, self._osc)
        if settings.midi:
            notes = NoteDecoder(settings.midi_note)
            self._listeners["midi"] = MidiListener(
                settings.midi_device, lambda data: [self._note(one) for one in notes.feed(data)]
            )
        if settings.xml_out:
            self._tellers["xml_out"] = XmlTeller(settings.targets(), settings.token)
        if settings.webhooks:
            self._tellers["webhooks"] = WebhookTeller(settings.webhook_urls, settings.token)

    def _end(self) -> None:
        for listener in self._listeners.values():
            listener.close()
        for teller in self._tellers.values():
            if isinstance(teller, WebhookTeller):
                teller.close()
        self._listeners, self._tellers = {}, {}

    def close(self) -> None:
        """Stop listening and sending."""
        with self._lock:
            self._end()

    def status(self) -> TriggersStatus:
        """Return the state of each trigger."""
        found = {name: one.heard.status() for name, one in {**self._listeners, **self._tellers}.items()}
        return TriggersStatus(**found, problem=self._problem)

    def tell(self, news: TriggerNews) -> None:
        """Send an event to all receivers; returns at once."""
        for teller in tuple(self._tellers.values()):
            teller.tell(news)

    # --- on the listeners' threads

    def _xml(self, data: bytes, host: str) -> tuple[str, str, bytes]:
        command = parse_capture(data)
        if command is None:
            return _UNKNOWN, "no CaptureStart or CaptureStop", b""
        return f"{command.kind} {command.name}".strip(), self._operator.perform(command, f"xml {host}"), b""

    def _osc(self, data: bytes, host: str) -> tuple[str, str, bytes]:
        commands = parse_osc(data, with_token=bool(self._operator.token))
        if commands is None:
            return _UNKNOWN, "no /record/start, /record/stop or /record/state", b""
        why = ""
        for command in commands:
            why = self._operator.perform(command, f"osc {host}")
        name = self._stage.recording_name()
        answer = state_message(name is not None, name or "", self._timecode(), why)
        return f"{commands[-1].kind} {commands[-1].name}".strip(), why, answer

    def _note(self, command: TriggerCommand) -> str:
        return self._operator.perform(command, "midi", has_token=False)

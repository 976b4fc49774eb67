"""The chosen source of timecode: `sessions/timecode.json`, so that it survives a restart."""

import logging
from pathlib import Path

from studio.engine.base.choices import load_choices, save_choices
from studio.engine.base.errors import SettingsError
from studio.engine.base.versions import CHOSEN_TIMECODE
from studio.timecode.incoming import IncomingTimecode

FILE = "timecode.json"
_log = logging.getLogger(__name__)


def choose_stored(sessions: Path, incoming: IncomingTimecode) -> None:
    """Listen to the source chosen last; an unreadable file counts as none."""
    try:
        load_choices(
            sessions / FILE,
            CHOSEN_TIMECODE,
            lambda value: incoming.choose(str(value["source"]), str(value["rate"])),
            None,
        )
    except SettingsError as error:
        _log.warning("%s", error)


def choose_at_first(sessions: Path, incoming: IncomingTimecode, source: str, rate: str) -> None:
    """Listen to this source unless one was chosen before; it is not stored.

    Raises:
        SettingsError: there is no such source or rate.
    """
    if not (sessions / FILE).is_file():
        incoming.choose(source, rate)


def choose_and_store(sessions: Path, incoming: IncomingTimecode, source: str, rate: str) -> None:
    """Listen to a source from now on, also after a restart.

    Raises:
        SettingsError: there is no such source or rate.
        StudioError: the disk refuses.
    """
    incoming.choose(source, rate)
    save_choices(sessions / FILE, CHOSEN_TIMECODE, {"source": source, "rate": rate})

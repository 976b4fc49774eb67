"""The chosen source of timecode: `sessions/timecode.json`, so that it is listened to again after a restart."""

import json
import logging
from pathlib import Path

from studio.engine.base.errors import StudioError
from studio.engine.base.files import write_json
from studio.engine.base.versions import CHOSEN_TIMECODE
from studio.timecode.incoming import IncomingTimecode

FILE = "timecode.json"
_log = logging.getLogger(__name__)


def choose_stored(sessions: Path, incoming: IncomingTimecode) -> None:
    """Listen to what was chosen last; a file that cannot be read counts as none."""
    path = sessions / FILE
    if not path.is_file():
        return
    try:
        value = CHOSEN_TIMECODE.current(json.loads(path.read_text(encoding="utf-8")), path.name)
        incoming.choose(str(value["source"]), str(value["rate"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, StudioError) as error:
        _log.warning("%s cannot be used: %s", path, error)


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
    write_json(sessions / FILE, CHOSEN_TIMECODE.stamped({"source": source, "rate": rate}))

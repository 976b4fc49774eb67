"""Files of an operator's choices, such as triggers or live outputs, so that they survive a restart."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from studio.engine.base.errors import SettingsError, StudioError
from studio.engine.base.files import write_json
from studio.engine.base.versions import FileFormat

_Chosen = TypeVar("_Chosen")


def load_choices(
    path: Path, kind: FileFormat, read: Callable[[dict[str, Any]], _Chosen], default: _Chosen
) -> _Chosen:
    """Return the choice in a file; the default without a file.

    Args:
        path: of the file.
        kind: of the file.
        read: converts the file's content, without its version, to the choice; raises if it is wrong.
        default: the value before the first choice.

    Raises:
        SettingsError: the file cannot be read, or holds a value that is not allowed.
    """
    if not path.is_file():
        return default
    try:
        return read(kind.current(json.loads(path.read_text(encoding="utf-8")), path.name))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, StudioError) as error:
        raise SettingsError(
            "settings.choices_unreadable",
            "{file} cannot be read ({error}); delete the file and choose again",
            file=path.name,
            error=error,
        ) from error


def save_choices(path: Path, kind: FileFormat, value: Mapping[str, Any]) -> None:
    """Store a choice.

    Raises:
        StudioError: the file cannot be written.
    """
    write_json(path, kind.stamped(value))

"""Presets of the program, and saved ones, in `sessions/presets.json`.

The file: `format_version` and `presets`, by name the settings as in `settings.json`.
"""

import json
import threading
from pathlib import Path
from typing import Any

from studio.engine.base.errors import FormatError, SettingsError, StudioError
from studio.engine.base.files import write_json
from studio.engine.base.versions import SAVED_PRESETS
from studio.engine.model.settings.settings import PRESETS, SolveSettings, changed
from studio.take.folder.names import is_safe_name

FILE = "presets.json"
MAX_PRESETS = 200


class Presets:
    """The presets of a folder of sessions; safe from any thread."""

    def __init__(self, sessions: Path) -> None:
        self._file = Path(sessions) / FILE
        self._lock = threading.Lock()

    def saved(self) -> dict[str, SolveSettings]:
        """Return the saved presets by name, without those that this version cannot use.

        Raises:
            SettingsError: the file is damaged or of a later version.
        """
        try:
            value = SAVED_PRESETS.current(json.loads(self._file.read_text(encoding="utf-8")), self._file)
            found = {name: _usable(settings) for name, settings in value.get("presets", {}).items()}
        except FileNotFoundError:
            return {}
        except FormatError as error:
            raise SettingsError(
                "settings.presets_file", "{problem}, or move the file away", problem=error
            ) from error
        except (OSError, ValueError, AttributeError) as error:
            raise SettingsError(
                "settings.presets_unreadable",
                "cannot read {path}: {error}; move it away to go on",
                path=self._file,
                error=error,
            ) from error
        return {name: settings for name, settings in found.items() if settings is not None}

    def all(self) -> dict[str, SolveSettings]:
        """Return the program's presets, then the saved ones, by name."""
        return {**PRESETS, **self.saved()}

    def settings(self, name: str, assignments: list[str] | tuple[str, ...] = ()) -> SolveSettings:
        """Return a preset's settings with `KEY=VALUE` assignments applied in order.

        Raises:
            SettingsError: an unknown preset, key or value.
        """
        base = PRESETS.get(name)
        return changed(self._find(name, self.saved()) if base is None else base, assignments)

    def save(self, name: str, settings: SolveSettings) -> None:
        """Store settings under a name; a saved preset of that name is replaced.

        Raises:
            SettingsError: a name that is not allowed, or one of the program's; too many presets.
        """
        _check_name(name)
        with self._lock:
            saved = self.saved()
            if name not in saved and len(saved) >= MAX_PRESETS:
                raise SettingsError(
                    "preset.too_many", "there are {n} presets already; remove one first", n=MAX_PRESETS
                )
            self._write({**saved, name: settings})

    def rename(self, name: str, to: str) -> None:
        """Rename a saved preset.

        Raises:
            SettingsError: no such preset, or a name that is taken or not allowed.
        """
        _check_name(to)
        with self._lock:
            saved = self.saved()
            self._find(name, saved)
            if to != name and to in saved:
                raise SettingsError(
                    "preset.taken", "there is a preset {name!r} already; choose another name", name=to
                )
            self._write({to if key == name else key: settings for key, settings in saved.items()})

    def remove(self, name: str) -> None:
        """Remove a saved preset.

        Raises:
            SettingsError: no such preset, or one of the program's.
        """
        with self._lock:
            saved = self.saved()
            self._find(name, saved)
            self._write({key: settings for key, settings in saved.items() if key != name})

    @staticmethod
    def _find(name: str, saved: dict[str, SolveSettings]) -> SolveSettings:
        if name in PRESETS:
            raise SettingsError(
                "preset.own",
                "preset {name!r} is the program's own and stays as it is; save another one",
                name=name,
            )
        if name not in saved:
            raise SettingsError(
                "settings.unknown_preset",
                "unknown preset {name!r}; allowed: {allowed}",
                name=name[:80],
                allowed=[*PRESETS, *saved],
            )
        return saved[name]

    def _write(self, presets: dict[str, SolveSettings]) -> None:
        value = {name: settings.to_json() for name, settings in presets.items()}
        write_json(self._file, SAVED_PRESETS.stamped({"presets": value}))


def _check_name(name: str) -> None:
    if name in PRESETS:
        raise SettingsError(
            "preset.own_name", "preset {name!r} is the program's own; choose another name", name=name
        )
    if not is_safe_name(name):
        raise SettingsError(
            "settings.preset_name",
            "preset name {name!r} is not allowed; allowed: 1 to 63 characters without / \\ : * ? "
            '" < > |, not beginning with a dot',
            name=name[:80],
        )


def _usable(value: Any) -> SolveSettings | None:
    try:
        return SolveSettings.from_json(value)
    except (StudioError, AttributeError, TypeError):
        return None

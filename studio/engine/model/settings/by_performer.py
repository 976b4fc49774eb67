"""The switch that holds the differences between performers."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from studio.engine.base.errors import SettingsError
from studio.engine.model.settings.switches import PerJoint

_NAME = re.compile(r"performer_[1-9]\d*")


def is_performer(name: str) -> bool:
    """Return whether a name is that of a performer: `performer_1`, `performer_2` and so on."""
    return _NAME.fullmatch(name) is not None


@dataclass(frozen=True)
class ByPerformer(PerJoint):
    """Switches of single performers, `performer_N.NAME=VALUE`, as a dictionary of such keys and texts.

    Attributes:
        common: switches that cannot differ between performers.
        check: receives a key and a text of the other switches; raises SettingsError if they are not allowed.
    """

    common: tuple[str, ...] = ()
    check: Callable[[str, str], object] = field(default=lambda key, text: None)

    written = ("performer_2.<setting>",)

    def parse_part(self, value: Mapping[str, Any], key: str, rest: list[str], given: Any) -> dict[str, Any]:
        performer, *part = rest
        name = ".".join(part)
        if not is_performer(performer) or not part or part[0] in (*self.common, self.name):
            raise SettingsError(
                "settings.of_performer",
                "unknown setting {key!r} of a performer; allowed: performer_1, performer_2 and so on with any "
                "setting but {common}",
                key=key,
                common=list(self.common),
            )
        self.check(name, str(given))
        return {**value, f"{performer}.{name}": str(given)}

    def from_json(self, value: Any) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for key, text in value.items():
            out = self.parse_part(out, key, key.split("."), text)
        return out

    def to_json(self, value: Mapping[str, Any]) -> dict[str, Any]:
        return dict(value)

    def texts(self, value: Mapping[str, Any]) -> dict[str, str]:
        return dict(value)

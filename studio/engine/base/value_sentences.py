"""Errors for values that are not allowed, the same in all rooms."""

from collections.abc import Iterable

from studio.engine.base.sentences import Said, say

Allowed = str | Iterable[str]
"""Allowed values: a text, or all their names."""


def bad_setting(key: str, value: object, allowed: Allowed) -> Said:
    """Return the error for a value that a setting does not allow, with the allowed values."""
    return say(
        "settings.value",
        "{key}={value!r} is not allowed; allowed: {allowed}",
        key=key,
        value=value,
        allowed=_listed(allowed),
    )


def bad_value(name: str, value: object, allowed: Allowed) -> Said:
    """Return the same for other values than settings, such as the option of a command."""
    return say(
        "value.bad",
        "{name} {value} is not allowed; allowed: {allowed}",
        name=name,
        value=value,
        allowed=_listed(allowed),
    )


def unknown(kind: str, name: str, allowed: Allowed) -> Said:
    """Return the error for an unknown name of a kind, with the known names."""
    return say(
        "value.unknown",
        "unknown {kind} {name!r}; allowed: {allowed}",
        kind=kind,
        name=name,
        allowed=_listed(allowed),
    )


def _listed(allowed: Allowed) -> str | list[str]:
    return allowed if isinstance(allowed, str) else [*allowed]

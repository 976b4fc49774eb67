"""What is said of values that are not allowed, alike in all rooms."""

from collections.abc import Iterable

from studio.engine.base.sentences import Said, say

Allowed = str | Iterable[str]
"""What is allowed: a text, or the names of all that is."""


def bad_setting(key: str, value: object, allowed: Allowed) -> Said:
    """Return that a setting cannot have a value, and which it can have."""
    return say(
        "settings.value",
        "{key}={value!r} is not allowed; allowed: {allowed}",
        key=key,
        value=value,
        allowed=_listed(allowed),
    )


def bad_value(name: str, value: object, allowed: Allowed) -> Said:
    """Return the same of what is not written as a setting, such as the option of a command."""
    return say(
        "value.bad",
        "{name} {value} is not allowed; allowed: {allowed}",
        name=name,
        value=value,
        allowed=_listed(allowed),
    )


def unknown(kind: str, name: str, allowed: Allowed) -> Said:
    """Return that nothing of a kind has that name, and what there is."""
    return say(
        "value.unknown",
        "unknown {kind} {name!r}; allowed: {allowed}",
        kind=kind,
        name=name,
        allowed=_listed(allowed),
    )


def _listed(allowed: Allowed) -> str | list[str]:
    return allowed if isinstance(allowed, str) else [*allowed]

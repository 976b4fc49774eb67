"""Names of sessions, takes and solves, and the guard that keeps every path inside its folder."""

import re
from pathlib import Path

from studio.engine.errors import TakeError

_NAME = re.compile(r"[^\x00-\x1f\x7f/\\:*?\"<>|]{1,63}")


def is_safe_name(name: str) -> bool:
    """Whether `name` may name a folder: 1 to 63 characters, none of / \\ : * ? " < > | or a control
    character, no dot in front, no dot or space at the end, no space in front."""
    return (
        _NAME.fullmatch(name) is not None
        and name == name.strip()
        and not name.startswith(".")
        and not name.endswith(".")
        and name.isprintable()
    )


def check_name(kind: str, name: str) -> str:
    """Return `name` where it is a safe folder name for a `kind` ("session", "take", "solve").

    Raises:
        TakeError: the name is empty, too long, or holds something that a path could be made of.
    """
    if not is_safe_name(name):
        raise TakeError(
            f"{kind} name {name[:80]!r} is not allowed; allowed: 1 to 63 characters without "
            '/ \\ : * ? " < > |, not beginning with a dot; choose another name'
        )
    return name


def inside(folder: Path, *parts: str) -> Path:
    """Return `folder / parts`, which lies inside `folder` even after links are followed.

    Raises:
        TakeError: the path would leave the folder.
    """
    path = folder.joinpath(*parts)
    root = folder.resolve()
    resolved = path.resolve()
    if resolved == root or not resolved.is_relative_to(root):
        raise TakeError(f"{'/'.join(parts)!r} leads out of {folder}; choose a plain name")
    return path

"""Names of sessions, takes and solves, and the check that every path stays inside its folder."""

import re
from collections.abc import Callable
from pathlib import Path

from studio.engine.base.errors import TakeError
from studio.engine.base.sentences import say

_NAME = re.compile(r"[^\x00-\x1f\x7f/\\:*?\"<>|]+")
_KINDS = {
    "session": say("name.session", "session"),
    "take": say("name.take", "take"),
    "performer": say("name.performer", "performer"),
    "solve": say("name.solve", "solve"),
    "reference": say("name.reference", "reference"),
}
_REFUSED = re.compile(r"[^\w .()+=@,&!#~-]+")

MAX_NAME = 63
"""Maximum length of one of the studio's own names."""


def is_safe_name(name: str, longest: int = MAX_NAME) -> bool:
    """Whether `name` may name a file or folder: 1 to `longest` characters, none of / \\ : * ? " < > | or a control
    character, no dot in front, no dot or space at the end, no space in front."""
    return (
        len(name) <= longest
        and _NAME.fullmatch(name) is not None
        and name == name.strip()
        and not name.startswith(".")
        and not name.endswith(".")
        and name.isprintable()
    )


def check_name(kind: str, name: str) -> str:
    """Return `name` if it is a safe folder name for a `kind` ("session", "take", "solve").

    Raises:
        TakeError: the name is empty, too long, or contains a part of a path.
    """
    if not is_safe_name(name):
        raise TakeError(
            "name.not_allowed",
            "{kind} name {name!r} is not allowed; allowed: 1 to 63 characters without / \\ : * ? "
            '" < > |, not beginning with a dot; choose another name',
            kind=_KINDS.get(kind, kind),
            name=name[:80],
        )
    return name


def safe_name(text: str, otherwise: str) -> str:
    """Return the allowed name of a take that is closest to a text; `otherwise` if nothing of it is left."""
    name = _REFUSED.sub("_", text).strip(" ._")[: MAX_NAME - 8].strip(" ._")
    return name if is_safe_name(name) else otherwise


def free_name(wanted: str, is_taken: Callable[[str], bool]) -> str:
    """Return the wanted name, numbered if it is taken: `walk`, `walk_2`, `walk_3`."""
    number, name = 1, wanted
    while is_taken(name):
        number += 1
        name = f"{wanted}_{number}"
    return name


def inside(folder: Path, *parts: str) -> Path:
    """Return `folder / parts`, which lies inside `folder` also after links are followed.

    Raises:
        TakeError: the path would leave the folder.
    """
    path = folder.joinpath(*parts)
    root = folder.resolve()
    resolved = path.resolve()
    if resolved == root or not resolved.is_relative_to(root):
        raise TakeError(
            "name.leads_out",
            "{name!r} leads out of {folder}; choose a plain name",
            name="/".join(parts),
            folder=folder,
        )
    return path

"""ES modules and all of their imports, as one block of text for a page without a server.

Each module's imports become `"module:NAME"`, which the page replaces with the other modules'
addresses. Modules come after their imports.
"""

import base64
import gzip
import re
from pathlib import Path

STATIC = Path(__file__).parents[2] / "web" / "static"
_THREE = STATIC / "vendor" / "three"
_NAMED = {"three": _THREE / "three.module.js"}
_BELOW = {"three/addons/": _THREE / "addons"}
_IMPORT = re.compile(r"""^((?:import|export)\s[^;'"]*?from\s+|import\s+)(['"])([^'"]+)\2""", re.MULTILINE)
_COMMENT = re.compile(r"^[ \t]*/\*\*.*?\*/[ \t]*\n", re.MULTILINE | re.DOTALL)


def bundle(entry: Path) -> list[tuple[str, str]]:
    """Return name and text of a module and of all of its imports, each after its own imports.

    Comments that document functions are removed; licences stay.
    """
    found: dict[Path, str] = {}
    _collect(entry.resolve(), found)
    return [(_name(path), text) for path, text in found.items()]


def packed(text: str | bytes) -> str:
    """Return text or bytes as base64 of gzip, deterministic."""
    data = text.encode() if isinstance(text, str) else text
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode("ascii")


def _collect(path: Path, found: dict[Path, str]) -> None:
    if path in found:
        return
    code = path.read_text(encoding="utf-8")
    code = _COMMENT.sub(lambda comment: comment[0] if "@license" in comment[0] else "", code)

    def place(match: re.Match[str]) -> str:
        other = _resolved(match[3], path)
        _collect(other, found)
        return f'{match[1]}"module:{_name(other)}"'

    code = _IMPORT.sub(place, code)
    found[path] = code


def _resolved(wanted: str, importer: Path) -> Path:
    if wanted in _NAMED:
        return _NAMED[wanted].resolve()
    for prefix, folder in _BELOW.items():
        if wanted.startswith(prefix):
            return (folder / wanted.removeprefix(prefix)).resolve()
    return (importer.parent / wanted).resolve()


def _name(path: Path) -> str:
    return path.relative_to(STATIC.resolve()).as_posix()

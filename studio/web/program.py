"""A page's program: its modules as one file, so that a browser sends one request, not 150 in sequence.

Each module becomes a function that runs once, after those that it imports, and returns what it exports. Modules of
`vendor/` and those of an import map stay imports. A source map shows the originals in the browser's tools.
"""

import hashlib
import json
import posixpath
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

_IMPORT = re.compile(r'^import (?:(?P<what>[^";]+) from )?"(?P<path>[^"]+)";', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:const|(?:async )?function|class) (?P<name>\w+))", re.MULTILINE)
_DEFAULT = re.compile(r"^export default ", re.MULTILINE)
_OTHER = re.compile(r"^(?:import|export)\b.*", re.MULTILINE)


@dataclass(frozen=True)
class Program:
    """A page's modules as one text, its source map (JSON), and a tag that changes with them."""

    text: str
    source_map: str
    tag: str


def program_of(folder: Path, entry: str) -> Program:
    """Return the program that begins with the module `entry` of a folder, such as `stage/main.js`.

    Raises:
        FileNotFoundError: the module or one of its imports is missing.
        ValueError: modules import each other, one imports what another does not export, or exports what is not a
            constant, function or class (an importer gets a value, which does not follow a variable).
    """
    found: dict[str, int] = {}
    _collect(folder, entry, found, [])
    return _program(folder, tuple(found.items()))


def is_vendor(path: str) -> bool:
    """Whether a file of the folder is third-party code, and served unchanged."""
    return path.startswith("vendor/")


def _collect(folder: Path, path: str, found: dict[str, int], importing: list[str]) -> None:
    """Add the module to `found`, after all its imports, with the time of its last change."""
    if path in importing:
        raise ValueError(f"modules import each other: {' -> '.join([*importing, path])}")
    changed = (folder / path).stat().st_mtime_ns
    for name in _imports(folder / path, changed):
        other = _inside(path, name)
        if other is not None and other not in found:
            _collect(folder, other, found, [*importing, path])
    found[path] = changed


@lru_cache(maxsize=1024)
def _imports(file: Path, _changed: int) -> list[str]:
    return [found["path"] for found in _IMPORT.finditer(file.read_text(encoding="utf-8"))]


def _inside(path: str, name: str) -> str | None:
    """Return the path of a module's import by its name; None for one that stays an import."""
    other = posixpath.normpath(posixpath.join(posixpath.dirname(path), name))
    return other if name.startswith(".") and not is_vendor(other) else None


@lru_cache(maxsize=16)
def _program(folder: Path, changed: tuple[tuple[str, int], ...]) -> Program:
    entry = changed[-1][0]
    here = posixpath.dirname(entry)
    variables = {path: f"module{number}" for number, (path, _) in enumerate(changed)}
    exports: dict[str, dict[str, str]] = {}  # for each module: variable by name
    outside: dict[str, str] = {}  # variable by import that stays
    parts, sections = [], []
    begin = 1  # line of the next module; the first line has the imports that stay
    for path, variable in variables.items():
        source = (folder / path).read_text(encoding="utf-8").rstrip("\n")

        def taken(found: re.Match[str], path: str = path) -> str:
            other = _inside(path, found["path"])
            if other is None:
                outer = found["path"]
                if outer.startswith("."):
                    whole = posixpath.join(posixpath.dirname(path), outer)
                    outer = posixpath.join(".", posixpath.relpath(whole, here))
                origin = outside.setdefault(outer, f"outside{len(outside)}")
            else:
                origin = variables[other]
            pattern, names = _pattern(found["what"] or "{}")
            if other is not None and (missing := sorted(names - exports[other].keys())):
                raise ValueError(f"{path} imports {', '.join(missing)}, which {other} does not export")
            return f"const {pattern} = {origin};" + "\n" * found[0].count("\n")

        text = _IMPORT.sub(taken, source)
        own = {found["name"]: found["name"] for found in _EXPORT.finditer(text)}
        text, defaults = _DEFAULT.subn("const exportedByDefault = ", _EXPORT.sub("", text))
        if other := _OTHER.search(text):
            raise ValueError(f"{path} has what cannot be part of a program: {other[0]}")
        exports[path] = own | ({"default": "exportedByDefault"} if defaults else {})
        returned = ", ".join(f"{name}: {value}" for name, value in exports[path].items())
        head = f"const {variable} = (() => {{ // {path}\n"
        parts.append(f"{head}{text}\nreturn {{ {returned} }};\n}})();\n")
        sections.append(_section(posixpath.relpath(path, here), begin + 1, text.count("\n") + 1))
        begin += parts[-1].count("\n")
    first = " ".join(f'import * as {variable} from "{name}";' for name, variable in outside.items())
    last = f"//# sourceMappingURL={posixpath.basename(entry)}?map\n"
    text = "".join([first, "\n", *parts, last])
    source_map = json.dumps({"version": 3, "sections": sections})
    return Program(text, source_map, hashlib.sha256(text.encode()).hexdigest())


def _pattern(what: str) -> tuple[str, set[str]]:
    """Return an import's names as the left side of an assignment, and the exports that it uses."""
    if what.startswith("* as "):
        return what.removeprefix("* as "), set()
    if not what.startswith("{"):
        return f"{{ default: {what} }}", {"default"}
    pairs = [pair.split() for pair in what.strip("{}").split(",") if pair.strip()]
    return f"{{ {', '.join(': '.join(pair[::2]) for pair in pairs)} }}", {pair[0] for pair in pairs}


def _section(source: str, line: int, lines: int) -> dict[str, object]:
    """Return the part of a source map that assigns the lines from this one on to a file."""
    one_each = ";".join(["AAAA", *["AACA"] * (lines - 1)])
    mapped = {"version": 3, "sources": [source], "names": [], "mappings": one_each}
    return {"offset": {"line": line, "column": 0}, "map": mapped}

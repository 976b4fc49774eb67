"""What the server says with a code stands in French under that code, with the same values."""

import ast
import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from string import Formatter

import pytest

import studio

HERE = Path(studio.__file__).parent
ERRORS = HERE / "engine" / "base" / "errors.py"
"""Its class passes its arguments on to `say`."""
REPORTS = HERE / "review" / "report"
"""Its `say` is another: the words of reports, which have French of their own."""
TABLES = sorted((HERE / "web" / "static" / "base" / "said").glob("*.js"))
CODE = re.compile(r"[a-z0-9_]+\.[a-z0-9_]+")
OF_THE_SYSTEM = "os."
"""Beginning of the codes of the system's own errors, which stand in no source."""
ONLY_FOR_PROGRAMS = {"id", "file", "same", "path", "take"}
"""Values of the English that the French need not show."""


ON_TERMINALS = (
    *(HERE / name for name in ("camera", "commands", "lab", "library.py", "server", "simulator", "wire")),
    *(HERE / "live" / name for name in ("cameras/previews.py", "keeping/keeping.py")),
    HERE / "api" / "cameras" / "link.py",
    HERE / "offline" / "batch",
)
"""What is said only here is read at a terminal, as a camera client's; it needs no French."""


@cache
def nodes() -> list[tuple[Path, ast.Call | ast.ClassDef]]:
    """Every call and every class in the program."""
    return [
        (path, node)
        for path in sorted(HERE.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call | ast.ClassDef)
    ]


@cache
def errors() -> set[str]:
    """Names of `StudioError` and of all that derive from it."""
    classes = [node for _, node in nodes() if isinstance(node, ast.ClassDef)]
    bases = {one: {ast.unparse(base) for base in one.bases} for one in classes}
    found, before = {"StudioError"}, 0
    while len(found) > before:
        before = len(found)
        found |= {one.name for one in classes if bases[one] & found}
    return found


def calls(names: set[str]) -> Iterator[tuple[Path, ast.Call]]:
    """Every call of these functions or classes in the program."""
    for path, node in nodes():
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names:
            yield path, node


def is_text(node: ast.expr) -> bool:
    """Whether an argument is a text without a code: written down, put together, or made by `str`."""
    if isinstance(node, ast.Call):
        return ast.unparse(node.func).split(".")[-1] in ("str", "repr", "join", "format")
    return isinstance(node, ast.JoinedStr | ast.BinOp | ast.BoolOp | ast.Constant)


def is_bare(call: ast.Call) -> bool:
    """Whether an error is made with a text that has no code."""
    return len(call.args) == 1 and is_text(call.args[0])


@cache
def said() -> list[tuple[Path, ast.Call]]:
    """Every sentence in the program, by `say` or by an error that makes one of a code and English."""
    by_errors = [one for one in calls(errors()) if len(one[1].args) == 2 and all(map(is_text, one[1].args))]
    by_say = [one for one in calls({"say"}) if one[0] != ERRORS and one[0].parent != REPORTS]
    return by_errors + by_say


def at(path: Path, call: ast.Call) -> str:
    return f"{path.relative_to(HERE)}, line {call.lineno}"


def sentences() -> dict[str, str]:
    """English by code, as it stands in the source."""
    found: dict[str, str] = {}
    for path, call in said():
        where = at(path, call)
        code, english = (getattr(argument, "value", None) for argument in call.args)
        assert isinstance(code, str) and isinstance(english, str), (
            f"{where}: code and text must be plain texts"
        )
        assert CODE.fullmatch(code), f"{where}: {code!r} is not of the form room.sentence"
        assert found.setdefault(code, english) == english, f"{where}: {code} stands for another text already"
    return found


def french() -> dict[str, str]:
    """French by code."""
    found: dict[str, str] = {}
    for path in TABLES:
        body = re.fullmatch(r"export default (\{.*\});\n", path.read_text(encoding="utf-8"), re.DOTALL)
        assert body, f"{path.name} is to be one object of strings"
        for code, text in json.loads(body.group(1), object_pairs_hook=lambda items: items):
            assert code not in found, f"{code} stands twice"
            found[code] = text
    return found


def english_values(text: str) -> dict[str, str]:
    """Names of a sentence's values and their formats."""
    return {name: form or "" for _, name, form, _ in Formatter().parse(text) if name is not None}


def french_values(text: str) -> dict[str, str]:
    """The same of the French, whose other braces stand for themselves."""
    return {name: form for name, form in re.findall(r"\{(\w+)(?::([^}]*))?\}", text)}


def test_errors_have_codes() -> None:
    bare = [at(path, call) for path, call in calls(errors()) if is_bare(call)]
    assert bare == [], "give a code before the text, and the values after it"


@pytest.mark.parametrize("given", ["'no'", "f'no {x}'", "'no ' + x", "str(x)", "', '.join(x)", "x or 'no'"])
def test_an_error_without_a_code_is_found(given: str) -> None:
    call = ast.parse(f"TakeError({given})", mode="eval").body
    assert isinstance(call, ast.Call) and is_bare(call)
    assert {"TakeError", "NoSuchShare", "DeviceLostError"} <= errors()


def test_every_sentence_that_the_page_can_show_has_french() -> None:
    shown = {
        ast.literal_eval(call.args[0])
        for path, call in said()
        if not any(path.is_relative_to(room) for room in ON_TERMINALS)
    }
    assert sorted(shown - french().keys()) == [], "give them French in studio/web/static/base/said/"


def test_no_french_stands_without_its_sentence() -> None:
    unsaid = french().keys() - sentences().keys()
    assert [code for code in unsaid if not code.startswith(OF_THE_SYSTEM)] == []


def test_calls_give_the_values_of_their_sentence() -> None:
    for path, call in said():
        given = {keyword.arg for keyword in call.keywords}
        assert given == english_values(ast.literal_eval(call.args[1])).keys(), at(path, call)


def test_both_languages_have_the_same_values() -> None:
    english = sentences()
    for code, text in french().items():
        if code.startswith(OF_THE_SYSTEM):
            continue
        wanted, shown = english_values(english[code]), french_values(text)
        assert shown.keys() <= wanted.keys(), code
        assert wanted.keys() - shown.keys() <= ONLY_FOR_PROGRAMS, code
        for name, form in shown.items():
            digits = re.fullmatch(r"\+?\.[1-9]f|\+\.0f", wanted[name])
            assert form == (wanted[name] if digits else ""), f"{code}: {name}"


def test_all_tables_are_read() -> None:
    script = (HERE / "web" / "static" / "base" / "said.js").read_text(encoding="utf-8")
    for path in TABLES:
        assert f'"./said/{path.name}"' in script

"""What the server says with a code stands in French under that code, with the same values."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import studio

HERE = Path(studio.__file__).parent
TABLES = sorted((HERE / "web" / "static" / "base" / "said").glob("*.js"))
CODE = re.compile(r"[a-z0-9_]+\.[a-z0-9_]+")
OF_THE_SYSTEM = "os."
"""Beginning of the codes of the system's own errors, which stand in no source."""
ONLY_FOR_PROGRAMS = {"id", "file", "same", "path", "take"}
"""Values of the English that the French need not show."""


def said() -> Iterator[tuple[str, ast.Call]]:
    """Every call of `say` in the program, and where it stands."""
    for path in sorted(HERE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if path.name == "sentences.py" or "sentences import" in source:
            for node in ast.walk(ast.parse(source)):
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "say":
                    yield f"{path.relative_to(HERE)}, line {node.lineno}", node


def sentences() -> dict[str, str]:
    """English by code, as it stands in the source."""
    found: dict[str, str] = {}
    for where, call in said():
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


def test_every_sentence_has_french() -> None:
    missing = sorted(sentences().keys() - french().keys())
    assert missing == [], "give them French in studio/web/static/base/said/"


def test_no_french_stands_without_its_sentence() -> None:
    unsaid = french().keys() - sentences().keys()
    assert [code for code in unsaid if not code.startswith(OF_THE_SYSTEM)] == []


def test_calls_give_the_values_of_their_sentence() -> None:
    for where, call in said():
        english = call.args[1]
        assert isinstance(english, ast.Constant), where
        given = {keyword.arg for keyword in call.keywords}
        assert given == english_values(str(english.value)).keys(), where


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

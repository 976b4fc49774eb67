"""Every word of the interface stands in both languages, is used, and has the same values in both."""

import json
import re
from pathlib import Path

import studio.web

WEB = Path(studio.web.__file__).parent
BASE = WEB / "static" / "base"
PARTS = sorted((BASE / "strings").rglob("*.js"))
CODE = [
    path
    for path in (WEB / "static").rglob("*.js")
    if BASE / "strings" not in path.parents and path.name != "strings.js"
]
TEMPLATES = sorted((WEB / "templates").glob("*.html"))


def parts() -> dict[str, list[str | None]]:
    """All words: `[English, French]` by key."""
    texts: dict[str, list[str | None]] = {}
    for path in PARTS:
        body = re.fullmatch(r"export default (\{.*\});\n", path.read_text(encoding="utf-8"), re.DOTALL)
        assert body, f"{path.name} is to be one object of strings"
        pairs = json.loads(re.sub(r",\s*\}$", "}", body.group(1)), object_pairs_hook=lambda items: items)
        for key, value in pairs:
            assert key not in texts, f"{key} stands twice"
            texts[key] = value
    return texts


def html(path: Path) -> str:
    """A template without its tags of Jinja."""
    return re.sub(r"\{%[^%]*%\}", "", path.read_text(encoding="utf-8"))


def template_keys(path: Path) -> set[str]:
    """Keys that a template names."""
    titles = re.findall(r"title_key %\}([^{]+)\{", path.read_text(encoding="utf-8"))
    return {*titles, *re.findall(r'data-t(?:-\w+)?="([^"]+)"', html(path))}


def used() -> tuple[set[str], set[str]]:
    """Keys that code and templates name, and beginnings of keys that code completes."""
    keys, beginnings = set(), set()
    for path in CODE:
        code = path.read_text(encoding="utf-8")
        keys |= set(re.findall(r"""["']([a-z_]+(?:\.[A-Za-z0-9_:]+)+)["']""", code))
        beginnings |= set(re.findall(r"`([a-z_]+\.(?:[A-Za-z0-9_:]+\.)*)\$\{", code))
    for path in TEMPLATES:
        keys |= template_keys(path)
    return keys, beginnings


def test_both_languages_have_words_with_the_same_values() -> None:
    for key, texts in parts().items():
        assert len(texts) == 2, key
        english, french = texts
        assert french and french.strip(), f"{key} has no French"
        assert english is None or english.strip(), f"{key} has no English"
        if english is not None:
            assert set(re.findall(r"\{\w+\}", english)) == set(re.findall(r"\{\w+\}", french)), key


def test_every_key_that_is_asked_for_has_words() -> None:
    texts = parts()
    for path in CODE:
        for key in re.findall(r"""\bt\(["']([^"']+)["']""", path.read_text(encoding="utf-8")):
            assert key in texts, f"{path.name} asks for {key}"
    for path in TEMPLATES:
        for key in template_keys(path):
            assert key in texts, f"{path.name} asks for {key}"


def test_no_words_are_unused() -> None:
    keys, beginnings = used()
    unused = [key for key in parts() if key not in keys and not key.startswith(tuple(beginnings))]
    assert unused == []


def test_templates_show_the_english_words_until_the_script_runs() -> None:
    texts = parts()
    for path in TEMPLATES:
        for key, shown in re.findall(r'data-t="([^"]+)"[^>]*>([^<]*)<', html(path)):
            assert shown in ("", texts[key][0]), f"{path.name}: {key}"


def test_all_parts_are_read() -> None:
    code = (BASE / "strings.js").read_text(encoding="utf-8")
    for path in PARTS:
        assert f'"./{path.relative_to(BASE).as_posix()}"' in code

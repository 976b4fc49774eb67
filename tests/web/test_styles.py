"""Decorative animations: they cost no layout and no painting, and stop if the system asks for it."""

import re
from pathlib import Path

import pytest

from studio import web
from studio.review.report.page import _STYLE
from studio.web.proxy import _INSERT

CHEAP = {"transform", "opacity", "visibility"}
"""A browser moves these without laying out or painting the page again."""

STYLES = sorted((Path(web.__file__).parent / "static").rglob("*.css"))

COLOUR = re.compile(r"#[0-9a-f]{3,8}|rgba\([\d, .]+\)|linear-gradient\(#[0-9a-f]+, #[0-9a-f]+\)|dark|light")


def of_themes(css: str) -> list[tuple[str, str]]:
    """Declarations for a light or a dark page alone: names and values."""
    alone = r"\[data-theme[^{]*\{([^{}]*)\}|prefers-color-scheme[^{]*\{\s*:root\s*\{([^{}]*)\}\s*\}"
    inner = "".join(f"{theme}{system};" for theme, system in re.findall(alone, css))
    inner = re.sub(r"/\*.*?\*/", "", inner)
    return re.findall(r"([\w-]+)\s*:\s*([^;]+?)\s*;", inner)


def moved(css: str) -> set[str]:
    """The properties that transitions and animations change."""
    transitions = re.findall(r"transition:\s*([^;}]+)", css)
    frames = re.findall(r"@keyframes \S+ \{((?:[^{}]*\{[^{}]*\})*)", css)
    return {part.split()[0] for one in transitions for part in one.split(",")} - {"none"} | {
        name for one in frames for body in re.findall(r"\{([^{}]*)\}", one)
        for name in re.findall(r"([\w-]+)\s*:", body)
    }  # fmt: skip


def test_all_of_them_are_found() -> None:
    css = "a { transition: width .2s, opacity 1s; } @keyframes go { from { left: 0; top: 0 } to { color: red; } }"
    assert moved(css) == {"width", "opacity", "left", "top", "color"}
    assert moved("* { transition: none !important; }") == set()


@pytest.mark.parametrize("path", STYLES, ids=lambda path: path.stem)
def test_what_moves_is_cheap(path: Path) -> None:
    """A bar whose width glided kept half a core busy for as long as work went on."""
    assert moved(path.read_text()) <= CHEAP


def test_endless_movements_rest_where_the_system_asks_for_it() -> None:
    css = "\n".join(path.read_text() for path in STYLES)
    endless = set(re.findall(r"([^\n{}]+)\{[^{}]*animation:[^;}]*infinite", css))
    resting = css[css.index("prefers-reduced-motion: reduce") :]
    assert endless
    for selector in endless:
        assert re.search(re.escape(selector.strip()) + r" \{ animation: none", resting), selector


@pytest.mark.parametrize(
    "css",
    [*(path.read_text() for path in STYLES), _STYLE, _INSERT],
    ids=[*(path.stem for path in STYLES), "report", "stage"],
)
def test_a_theme_changes_colours_alone(css: str) -> None:
    """So a page that is held against axe in the one theme needs only be looked at for its colours in the other."""
    declared = of_themes(css)
    assert bool(declared) == bool(re.search("data-theme|prefers-color-scheme", css))
    for name, value in declared:
        assert COLOUR.fullmatch(value) and re.match("--|color-scheme|background", name), (name, value)


def test_what_a_theme_changes_is_found() -> None:
    assert of_themes('p { margin: 0 } :root[data-theme="light"] { --a: #fff; color-scheme: light; }') == [
        ("--a", "#fff"),
        ("color-scheme", "light"),
    ]
    assert of_themes("@media (prefers-color-scheme: light) {\n :root { --a: 3px } \n}") == [("--a", "3px")]
    assert not any(map(COLOUR.fullmatch, ("3px", "none", "calc(1px + 2px)")))
    assert all(map(COLOUR.fullmatch, ("#fff", "rgba(0, 0, 0, .25)", "light")))

"""What moves for its looks: it costs no layout and no painting, and rests where the system asks for it."""

import re
from pathlib import Path

import pytest

from studio import web

CHEAP = {"transform", "opacity", "visibility"}
"""A browser moves these without laying out or painting the page again."""

STYLES = sorted((Path(web.__file__).parent / "static").rglob("*.css"))


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

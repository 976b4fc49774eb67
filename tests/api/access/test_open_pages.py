"""Pages for people who have not signed in get all that they are made of."""

import re
from importlib import resources
from pathlib import Path

import pytest

from studio.api.access.guard import is_open

STATIC = Path(str(resources.files("studio.web") / "static"))
TEMPLATES = STATIC.with_name("templates")


def modules(file: Path) -> set[Path]:
    """The module and all that it imports, by way of others too."""
    found, new = set(), {file.resolve()}
    while new:
        one = new.pop()
        found.add(one)
        names = re.findall(r'^import (?:[^"]* from )?"(\.[^"]+)"', one.read_text(encoding="utf-8"), re.M)
        new |= {(one.parent / name).resolve() for name in names} - found
    return found


@pytest.mark.parametrize(
    ("entry", "least"),
    [("access/signin.js", 4), ("cameras/camera_page.js", 4), ("vote/vote.js", 6), ("base/theme.js", 1)],
)
def test_their_modules_are_open(entry, least):
    paths = ["/static/" + file.relative_to(STATIC).as_posix() for file in modules(STATIC / entry)]
    assert len(paths) >= least
    assert [path for path in paths if not is_open(path)] == []


def test_a_token_never_stands_in_the_address():
    """Where the script is not there yet, a browser sends the form by itself."""
    assert '<form id="sign-in" method="post">' in (TEMPLATES / "signin.html").read_text(encoding="utf-8")

"""Every link, anchor and path in every Markdown file leads somewhere."""

import re
from pathlib import Path
from urllib.parse import urlsplit

import pytest

ROOT = Path(__file__).parents[1]
HIDDEN = re.compile(r"^(\.|node_modules$|dist$|sessions$)")
FENCE = re.compile(r"^(```+).*?^\1[ \t]*$", re.M | re.S)
INDENTED = re.compile(r"(?:^|\n)\n((?: {4,}.*\n?)+)")
CODE = re.compile(r"`[^`\n]+`")
LINK = re.compile(r"\]\(\s*<?([^)>\s]+)>?[^)]*\)")
BARE = re.compile(r"<(https?:[^>\s]+)>")
PATH = re.compile(r"`((?:studio|tests|docs|docker)/[\w./-]+)`")


def markdown_files(folder: Path = ROOT) -> list[Path]:
    """All Markdown files below a folder, but those of other projects."""
    found = [path for path in sorted(folder.glob("*.md"))]
    for child in sorted(folder.iterdir()):
        if child.is_dir() and not HIDDEN.match(child.name):
            found += markdown_files(child)
    return found


def without_code(text: str) -> str:
    """The text without code blocks, in which brackets are no links."""
    return INDENTED.sub("\n", FENCE.sub("", text))


def links(text: str) -> list[str]:
    prose = CODE.sub("", without_code(text))
    return LINK.findall(prose) + BARE.findall(prose)


def anchors(text: str) -> set[str]:
    """The anchors of a file's headings, as GitHub and the site make them."""
    found: set[str] = set()
    for heading in re.findall(r"^#{1,4} +(.+?)\s*$", without_code(text), re.M):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "")
        slug = re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")
        name, number = slug, 0
        while name in found:
            number += 1
            name = f"{slug}-{number}"
        found.add(name)
    return found


def problem_of(link: str, file: Path) -> str:
    """Why a link in a file leads nowhere; empty where it leads somewhere. Addresses outside only by their form."""
    parts = urlsplit(link)
    if parts.scheme:
        good = parts.scheme in ("https", "http", "mailto") and (parts.scheme == "mailto" or parts.hostname)
        return "" if good else "not an address"
    target = (file.parent / parts.path).resolve() if parts.path else file
    if not target.is_relative_to(ROOT) and not target.is_relative_to(file.parent):
        return "leads out of the project"
    if not target.exists():
        return "no such file"
    if parts.fragment and parts.fragment not in anchors(target.read_text(encoding="utf-8")):
        return "no such heading"
    return ""


FILES = markdown_files()


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(file):
    text = file.read_text(encoding="utf-8")
    problems = {link: problem_of(link, file) for link in links(text)}
    assert {link: problem for link, problem in problems.items() if problem} == {}


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_paths_in_the_text_exist(file):
    paths = PATH.findall(without_code(file.read_text(encoding="utf-8")))
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_all_documents_are_looked_at():
    names = {path.relative_to(ROOT).as_posix() for path in FILES}
    assert {
        "README.md",
        "CHANGELOG.md",
        "docs/api.md",
        "docs/guide/export.md",
        "docs/decisions/README.md",
    } <= names
    assert sum(len(links(path.read_text(encoding="utf-8"))) for path in FILES) > 150


@pytest.mark.parametrize(
    ("link", "problem"),
    [
        ("there.md", ""),
        ("there.md#a-heading-with-code", ""),
        ("#here", ""),
        ("https://example.org/a#b", ""),
        ("gone.md", "no such file"),
        ("there.md#gone", "no such heading"),
        ("there.md#in-code", "no such heading"),
        ("#gone", "no such heading"),
        ("https:///nowhere", "not an address"),
        ("htps://example.org", "not an address"),
        ("../../../../etc/hostname", "leads out of the project"),
    ],
)
def test_bad_links_are_noticed(tmp_path, link, problem):
    """The canary."""
    (tmp_path / "there.md").write_text("# A heading, with `code`\n\n```\n# in code\n```\n", encoding="utf-8")
    file = tmp_path / "file.md"
    file.write_text(f"# Here\n\n[text]({link}), `[not](one)`\n\n    [nor](this)\n", encoding="utf-8")
    assert links(file.read_text(encoding="utf-8")) == [link]
    assert problem_of(link, file) == problem

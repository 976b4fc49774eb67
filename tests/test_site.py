"""The documentation is built as a site; every warning is an error."""

import importlib.util
import inspect
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

import studio

ROOT = Path(__file__).parents[1]


def build(sources: Path, out: Path) -> subprocess.CompletedProcess[str]:
    """Run the command of CONTRIBUTING.md on other folders."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-c", str(ROOT / "docs")]
    return subprocess.run([*command, str(sources), str(out)], cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module", autouse=True)
def builder():
    if importlib.util.find_spec("sphinx") is None:
        pytest.skip("the group `docs` of pyproject.toml is not installed")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("site")
    built = build(ROOT, out)
    assert built.returncode == 0, built.stderr
    return out


class Loaded(HTMLParser):
    """What a page loads by itself: scripts, styles, pictures."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = {"script": "src", "img": "src", "link": "href"}
        value = dict(attrs).get(names.get(tag, ""))
        if value:
            self.addresses.append(value)


def test_every_document_is_a_page_of_the_site(site):
    documents = [path.relative_to(ROOT).with_suffix(".html") for path in ROOT.glob("docs/**/*.md")]
    documents += [Path(f"{name}.html") for name in ("README", "ARCHITECTURE", "CONTRIBUTING", "CHANGELOG")]
    assert [str(page) for page in documents if not (site / page).exists()] == []


def test_the_home_is_the_readme_with_the_navigation(site):
    assert "url=README.html" in (site / "index.html").read_text(encoding="utf-8")
    home = (site / "README.html").read_text(encoding="utf-8")
    for page in (
        "docs/guide/README.html",
        "docs/switches.html",
        "docs/python.html",
        "docs/decisions/README.html",
    ):
        assert f'href="{page}"' in home


def test_everything_public_is_described_from_its_docstring(site):
    page = (site / "docs" / "python.html").read_text(encoding="utf-8")
    for name in studio.__all__:
        value = getattr(studio, name)
        if name.endswith("Config") and name not in ("SourceConfig", "DeviceConfig"):
            assert name in page
        elif inspect.isclass(value) or inspect.isfunction(value):
            assert f'id="{value.__module__}.{value.__qualname__}"' in page, name


def test_pages_load_nothing_from_elsewhere(site):
    for page in site.rglob("*.html"):
        loaded = Loaded()
        loaded.feed(page.read_text(encoding="utf-8"))
        assert [address for address in loaded.addresses if "//" in address] == [], page


def test_a_link_that_leads_nowhere_breaks_the_build(tmp_path):
    """The canary of the strict build."""
    sources = tmp_path / "sources"
    sources.mkdir()
    (sources / "README.md").write_text("# Home\n\n[gone](gone.md)\n", encoding="utf-8")
    built = build(sources, tmp_path / "out")
    assert built.returncode != 0 and "gone.md" in built.stderr

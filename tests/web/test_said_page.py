"""The page in French tells in French why the server refuses: by the codes that come with its answers."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving
from tests.web.test_page import studio

pytestmark = pytest.mark.browser


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    take_with_solves(tmp_path / "monday" / "one")
    return tmp_path


@pytest.fixture
def page(chromium: Browser, sessions: Path) -> Iterator[Page]:
    """The page of a studio with one take, in French; its console may tell of refused requests."""
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script("localStorage.setItem('language', 'fr')")
    with studio(sessions) as (app, _), serving(app) as url:
        page.goto(url)
        expect(page.locator("#connection")).to_have_text("Connecté")
        yield page
        page.close()


def save(page: Page, field: str, value: str) -> None:
    """Change the take's slate."""
    page.get_by_label("Modifier one").click()
    page.locator(f"#slate-{field}").fill(value)
    page.locator(f"#slate-{field}").press("Enter")


def test_a_name_that_is_not_allowed(page: Page) -> None:
    save(page, "name", ".hidden")
    expect(page.locator("#messages")).to_contain_text(
        "le nom de prise «\u00a0.hidden\u00a0» n'est pas permis\u00a0; permis\u00a0: 1 à 63 caractères"
    )


def test_a_tag_that_is_not_allowed(page: Page) -> None:
    save(page, "tags", 'best "one"')
    expect(page.locator("#messages")).to_contain_text(
        "l'étiquette «\u00a0best \"one\"\u00a0» n'est pas permise"
    )

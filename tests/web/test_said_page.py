"""The page in French tells in French why the server refuses: by the codes that come with its answers."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from tests import patient
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving
from tests.web.test_page import performing, studio

pytestmark = pytest.mark.browser


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    take_with_solves(tmp_path / "monday" / "one")
    return tmp_path


@pytest.fixture
def address(sessions: Path) -> Iterator[str]:
    """Address of a studio with one take."""
    with studio(sessions) as (app, _), serving(app) as url:
        yield url


@pytest.fixture
def page(chromium: Browser, address: str) -> Iterator[Page]:
    """The page in French; its console may tell of refused requests."""
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.add_init_script("localStorage.setItem('language', 'fr')")
    page.goto(address)
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


def test_a_take_that_is_gone(page: Page, sessions: Path) -> None:
    def vanish(route: Route) -> None:
        shutil.rmtree(sessions / "monday" / "one")
        route.continue_()

    page.route("**/api/v1/takes/monday/one", vanish, times=1)
    save(page, "name", "other")
    expect(page.locator("#messages")).to_contain_text("il n'y a pas de prise monday/one")


def test_a_calibration_that_is_refused(page: Page, address: str) -> None:
    with performing(address):
        patient.post(f"{address}/api/v1/calibration/start", json={"seconds": 1.0}).raise_for_status()
        expect(page.locator("#calibration .reasons, #calibration .bad").first).to_contain_text(
            "paires d'articulations avec la caméra de référence"
        )


def test_what_is_told_of_a_take_that_cannot_be_read(page: Page, sessions: Path) -> None:
    (sessions / "monday" / "one" / "take.json").write_text("not JSON")
    page.reload()  # what another program does within a take is seen when the takes are listed again
    expect(page.locator(".take .fair")).to_contain_text("ne peut être lu")
    expect(page.locator(".take .fair")).to_contain_text("lancez `studio doctor` pour le refaire")

"""Two performers on the page: from the first frames to a named take, with an exchange that is taken back."""

import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from studio.api.app import create_app
from studio.api.takes.find import Finder
from studio.take.folder.performers import shown_name
from studio.take.folder.solves import read_metrics
from studio.take.folder.take import Take
from studio.web import mount
from tests import patient
from tests.live.test_performers import Shoot, a_second_performer
from tests.web.stages import serving, until

pytestmark = pytest.mark.browser


@pytest.fixture
def shot(tmp_path: Path, ready_pipeline: None) -> Iterator[tuple[Shoot, str]]:
    """A stage of two performers, and the address of its page."""
    shoot = Shoot(tmp_path / "sessions")
    app = create_app(shoot.stage, shoot.stage.sessions)
    sessions = shoot.stage.sessions
    view = mount(
        app, shoot.stage, sessions=sessions, takes=Finder(shoot.stage, sessions), jobs=app.state.jobs
    )
    try:
        with serving(app) as url:
            yield shoot, url
    finally:
        shoot.stage.close()
        view.close()


def apart_m(shoot: Shoot) -> float:
    """How far the second performer stands to the right of the first."""
    result = shoot.stage.results.get()[1]
    assert result is not None
    first, second = result.each()
    return float(second.positions_m[0, 0] - first.positions_m[0, 0])


def test_two_performers_from_the_first_frames_to_a_take(shot: tuple[Shoot, str], page: Page) -> None:
    shoot, url = shot
    shoot.play(0.5, second=False)
    page.goto(url)
    expect(page.locator("#performer")).to_be_visible()
    expect(page.locator("#people")).to_be_hidden()
    a_second_performer(shoot)
    rows = page.locator("#people li")
    expect(rows).to_have_count(2)
    colours = [row.locator(".swatch").get_attribute("style") for row in rows.all()]
    assert len(set(colours)) == 2
    rows.nth(1).locator("input").fill("Bo")
    rows.nth(1).locator("input").press("Enter")
    exchange = page.get_by_role("button", name="Exchange performer_1 and Bo")
    expect(exchange).to_be_visible()

    page.locator("#record").click()
    expect(page.locator("#record")).to_contain_text("Stop")
    shoot.play(0.7)
    assert apart_m(shoot) > 1.0
    exchange.click()
    expect(page.locator("#messages")).to_contain_text("performer_1 and Bo are exchanged")
    shoot.play(0.7)
    assert apart_m(shoot) < -1.0
    page.locator("#undo").click()
    expect(page.locator("#undo")).to_have_attribute("title", "Undo (Ctrl+Z): performer_2 is now Bo")
    shoot.play(0.7)
    assert apart_m(shoot) > 1.0
    shoot.hidden_from = {"camera_1"}
    shoot.play(2.0)
    expect(page.locator("#warning")).to_contain_text("Bo is not seen by camera_1")
    page.locator("#record").click()
    expect(page.locator("#takes")).to_contain_text("take_001")

    (path,) = shoot.stage.sessions.glob("*/take_001")
    until(lambda: Take.open(path).performer_names("live") == ["performer_1", "performer_2"])  # it is written
    take = Take.open(path)
    assert shown_name(take.meta, "performer_2") == "Bo"

    page.evaluate("localStorage.setItem('language', 'fr')")
    page.reload()
    expect(page.get_by_role("button", name="Échanger performer_1 et Bo")).to_be_visible()
    page.goto(f"{url}/remote")
    expect(page.locator("#people")).to_contain_text("Bo n'est pas vu par camera_1")

    page.evaluate("localStorage.setItem('language', 'en')")
    page.goto(url)
    page.get_by_role("button", name="Replay take_001, solve live").click()
    expect(page.locator("#replay-time")).to_contain_text("/")
    page.locator("#preset").select_option("finish")
    until(lambda: read_metrics(take.solve_folder("trial")) is not None, 180.0)  # of the whole take
    assert take.performer_names("trial") == ["performer_1", "performer_2"]
    page.locator("#open-take").get_by_role("button", name="Export").click()
    page.locator("#export-format").select_option("bvh")
    with page.expect_download() as made:
        page.locator("#export-run").click()
    with zipfile.ZipFile(made.value.path()) as files:
        assert sorted(Path(name).suffix for name in files.namelist()) == [".bvh", ".bvh"]
        assert any("Bo" in name for name in files.namelist())


def test_a_target_of_a_performer_gets_theirs_alone(shot: tuple[Shoot, str], page: Page) -> None:
    shoot, url = shot
    a_second_performer(shoot)
    page.goto(url)
    page.locator("#outputs-title").click()  # the panel is folded at first
    page.locator("#output-performer").select_option("performer_2")
    page.locator("#output-port").fill("39600")
    page.locator(".output-form button").click()
    expect(page.locator("#outputs li")).to_contain_text("performer_2")
    (target,) = patient.get(f"{url}/api/v1/outputs").json()["outputs"]
    assert (target["performer"], target["kind"]) == ("performer_2", "vmc")

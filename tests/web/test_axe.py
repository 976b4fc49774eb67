"""Every page in every state is held against axe: dark and light, on a laptop and on a phone."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from studio.engine.model.poses import Poses
from studio.lab.study.page import write_study
from studio.lab.study.plan import make_plan
from tests import patient
from tests.live.performer import calibration, save_stage_calibration
from tests.web.axe import found_in
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until
from tests.web.test_compare_page import reference_csv
from tests.web.test_page import NAMES, open_page, performing, serving, studio
from tests.web.test_vote_page import make_test

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]
CLOSE = "document.querySelectorAll('dialog[open]').forEach((one) => one.close())"


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Takes, and a calibrated stage."""
    sessions = tmp_path_factory.mktemp("sessions")
    for number, name in enumerate(("one", "two", "gone")):
        take = take_with_solves(sessions / "monday" / name, seed=number)
        take.add_calibration(calibration(["camera_0"]), use=True)
    save_stage_calibration(sessions, NAMES)
    return sessions


@pytest.fixture(scope="module")
def address(sessions: Path) -> Iterator[str]:
    """Address of a studio without cameras; a take is in the trash, and an export is done."""
    with studio(sessions) as (app, _), serving(app) as url:
        patient.delete(f"{url}/api/v1/takes/monday/gone").raise_for_status()
        wanted = {"format": "bvh", "solves": [{"take": "monday/two", "solve": "studio"}]}
        patient.post(f"{url}/api/v1/exports", json=wanted, timeout=120.0).raise_for_status()
        yield url


def stage_without_cameras(page: Page, url: str) -> Iterator[str]:
    open_page(page, url)
    expect(page.locator("#guide")).to_be_visible()
    yield "guide"
    page.locator("#help-button").click()
    page.fill("#help-search", "camera")
    yield "help"
    page.evaluate(CLOSE)
    for opener in ("trash-open", "import-open"):
        page.locator(f"#{opener}").click()
        expect(page.locator("dialog[open]")).to_be_visible()
        yield opener
        page.evaluate(CLOSE)
    page.get_by_role("button", name="Other cameras").click()
    expect(page.locator("#add-camera-dialog")).to_be_visible()
    yield "cameras of other machines"
    page.evaluate(CLOSE)
    page.locator("#work-button").click()
    expect(page.locator("#work")).to_be_visible()
    yield "work"


def stage_with_cameras(page: Page, url: str) -> Iterator[str]:
    with performing(url):
        open_page(page, url)
        expect(page.locator("#record")).to_be_enabled()
        page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        yield "live, all switches"
        page.locator("#record").click()
        expect(page.locator("#record")).to_have_attribute("aria-pressed", "true")
        yield "recording"
        page.locator("#record").click()
        expect(page.locator("#record")).to_have_attribute("aria-pressed", "false")
        page.locator("#calibrate").click()
        expect(page.locator("#wizard")).to_be_visible()
        yield "wizard"


def replay(page: Page, url: str) -> Iterator[str]:
    pin = {
        "kind": "pin",
        "joint": "left_wrist",
        "place_m": [0, 0, 1],
        "start_s": 0.5,
        "end_s": 0.5,
        "note": "here",
    }
    doubt = {"kind": "leave_out", "joints": ["head"], "start_s": 0.5, "end_s": 1.0, "on": False}
    for edit in (pin, doubt):
        patient.post(f"{url}/api/v1/takes/monday/one/edits", json={"edit": edit}).raise_for_status()
    open_page(page, url)
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#edit-list li")).to_have_count(2)
    expect(page.locator("#timeline")).to_be_visible()
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    yield "replay"
    page.locator("#replay-video").click()
    expect(page.locator("#video")).to_be_visible()
    yield "video"
    page.locator("#video-close").click()
    page.locator("#replay-compare").click()
    expect(page.locator("#compare .figures")).to_contain_text("Jitter")
    yield "compare"
    page.locator("#compare-close").click()
    page.get_by_role("button", name="Share one, solve studio").first.click()
    expect(page.locator(".sharing")).to_be_visible()
    yield "share"
    page.evaluate(CLOSE)
    page.get_by_role("button", name="Export one, solve studio").first.click()
    page.locator("#export-advanced > summary").click()
    yield "export"
    page.evaluate(CLOSE)
    page.get_by_role("button", name="Edit one").first.click()
    page.get_by_label("Select one").check()
    page.get_by_label("Select two").check()
    yield "selection and slate"


def smaller_pages(page: Page, url: str) -> Iterator[str]:
    for path in ("/remote", "/signin", "/signin?again", "/camera", "/?view", "/phone"):
        page.goto(url + path)
        expect(page.locator("h1").first).to_be_visible()
        yield path
    page.evaluate("document.body.dataset.view = 'camera'; document.querySelector('#settings').showModal()")
    yield "settings of a phone"


def blind_tests(page: Page, url: str) -> Iterator[str]:
    trial = make_test(url, allow_none=True, ask_name=True)
    vote = f"{url}/api/v1{trial['path']}"
    voter = {"X-Voter": patient.post(f"{vote}/join", json={"name": "Ada"}).json()["voter"]}
    chosen = {"choice": "left", "watched_s": 3.0, "comment": "the feet stand still in this one"}
    patient.put(f"{vote}/0", json=chosen, headers=voter).raise_for_status()
    page.goto(f"{url}/blind#{trial['id']}")
    expect(page.locator(".result .bar")).to_have_count(1)
    yield "author"
    page.goto(url + trial["path"])
    expect(page.get_by_role("button", name="Begin")).to_be_visible()
    yield "vote, before"
    page.get_by_role("button", name="Begin").click()
    expect(page.locator("body")).to_have_attribute("data-ready", "0")
    yield "vote"


def documents(page: Page, url: str) -> Iterator[str]:
    share = patient.post(f"{url}/api/v1/takes/monday/one/solves/studio/share", timeout=120.0).json()
    page.goto(url + share["path"])
    expect(page.locator("body")).to_have_attribute("data-ready", "")
    yield "shared replay"


PAGES = (stage_without_cameras, stage_with_cameras, replay, smaller_pages, blind_tests, documents)


@pytest.mark.viewing
@pytest.mark.parametrize("states", PAGES, ids=lambda states: states.__name__)
def test_axe_finds_nothing(states: Callable[[Page, str], Iterator[str]], address: str, page: Page) -> None:
    found: list[str] = []
    for state in states(page, address):
        found += found_in(page, state)
    assert not found, "\n".join(found)


def test_axe_finds_nothing_in_a_report(address: str, sessions: Path, page: Page) -> None:
    poses = Poses.load(sessions / "monday/two/solves/live/poses.npz")
    take = f"{address}/api/v1/takes/monday/two"
    patient.put(
        f"{take}/references/truth.csv", content=reference_csv(poses), timeout=120.0
    ).raise_for_status()
    job = patient.post(f"{take}/reports", json={"reference": "truth.csv"}, timeout=120.0).json()
    jobs = f"{address}/api/v1/jobs/{job['id']}"
    until(lambda: patient.get(jobs).json()["state"] == "done")
    page.goto(f"{take}/reports/{job['name']}")
    found = found_in(page, "report")
    assert not found, "\n".join(found)


def test_axe_finds_nothing_in_a_study(tmp_path: Path, page: Page) -> None:
    study = make_plan((), cameras=(1, 2), seeds=1, unit_m=None)
    page.goto(write_study(study, [], {}, tmp_path).as_uri())
    found = found_in(page, "study")
    assert not found, "\n".join(found)

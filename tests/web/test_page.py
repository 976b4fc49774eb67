"""The page in a real browser, on the real routes: states, switches, recording, solving, exporting."""

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from fastapi import FastAPI
from playwright.sync_api import APIResponse, Browser, Page, Route, expect

from studio.api.access import Access
from studio.api.app import create_app
from studio.api.takes.find import Finder
from studio.live import LiveStage
from studio.web import mount
from tests import patient
from tests.api.camera import Camera
from tests.live.performer import save_stage_calibration
from tests.web.browser import wait_for_undos
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving, until

pytestmark = pytest.mark.browser
SIZES = ((1280, 720), (1920, 1080), (390, 844))
NAMES = ["camera_0", "camera_1"]

# Controls without a name that a screen reader could say.
NAMELESS = """() => [...document.querySelectorAll("button, input, select, iframe, progress, a")].filter((e) =>
    !(e.getAttribute("aria-label") || e.title || e.textContent.trim()
      || [...(e.labels ?? [])].some((label) => label.textContent.trim())))
  .map((e) => e.outerHTML)"""

# Texts whose contrast with what is behind them is under 4.5:1, once colours have gone over.
FAINT = """async () => {
  const ending = document.getAnimations().filter((a) => a.effect.getComputedTiming().endTime !== Infinity);
  await Promise.allSettled(ending.map((a) => a.finished));
  const rgb = (text) => text.match(/[\\d.]+/g).map(Number)
    .map((v, i) => text.startsWith("color") && i < 3 ? 255 * v : v);
  const luminance = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (e) => {
    for (; e; e = e.parentElement) {
      const colour = rgb(getComputedStyle(e).backgroundColor);
      if (colour.length < 4 || colour[3] > 0.8) return colour;
    }
    return [255, 255, 255];
  };
  return [...document.querySelectorAll("body *")].filter((e) => e.checkVisibility()
      && !e.closest(":disabled, [aria-hidden=true], option, head")
      && [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))
    .map((e) => {
      const [a, b] = [luminance(rgb(getComputedStyle(e).color)), luminance(behind(e))];
      return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), e.outerHTML];
    }).filter(([ratio]) => ratio < 4.5);
}"""


@contextmanager
def studio(sessions: Path, access: Access | None = None) -> Iterator[tuple[FastAPI, LiveStage]]:
    stage = LiveStage(sessions)
    stage.start()
    app = create_app(stage, sessions, access=access)
    view = mount(app, stage, sessions=sessions, takes=Finder(stage, sessions), jobs=app.state.jobs)
    try:
        yield app, stage
    finally:
        for part in (app.state.local_cameras, app.state.devices, app.state.announced, app.state.triggers):
            part.close()
        stage.close()
        app.state.outputs.close()
        view.close()


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[str]:
    """Address of a studio without cameras and takes."""
    with studio(tmp_path) as (app, _), serving(app) as url:
        yield url


@contextmanager
def performing(url: str) -> Iterator[None]:
    """Two calibrated cameras see the made-up performer at 30 Hz."""
    stop = threading.Event()
    cameras = [Camera(url.replace("http", "ws") + "/api/v1/link", index) for index in range(2)]
    for camera in cameras:
        camera.greet()
        camera.exchange_clocks()

    def send() -> None:
        while not stop.wait(1 / 30):
            for camera in cameras:
                camera.send_frame()

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
        for camera in cameras:
            camera.socket.close()


@pytest.fixture
def live(tmp_path: Path) -> Iterator[str]:
    """Address of a studio with two calibrated cameras and a performer."""
    save_stage_calibration(tmp_path, NAMES)
    with studio(tmp_path) as (app, _), serving(app) as url, performing(url):
        yield url


def open_page(page: Page, url: str) -> None:
    page.goto(url)
    expect(page.locator("#connection")).to_have_text("Connected")
    expect(page.locator("#preset")).to_be_visible()


def test_a_view_whose_server_is_away_is_no_error_of_the_page(empty: str, chromium: Browser) -> None:
    page = chromium.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    open_page(page, empty)
    page.route("**/viewer/**", lambda route: route.abort("connectionrefused"))
    page.evaluate("""() => new Promise((loaded) => {
      const frame = document.getElementById("viewer");
      frame.addEventListener("load", loaded, { once: true });
      frame.src += "";
    })""")
    assert page.locator("#viewer").evaluate("(frame) => frame.contentDocument === null")
    assert not errors
    page.close()


def test_an_empty_studio_says_what_to_do_and_takes_settings(empty: str, page: Page) -> None:
    open_page(page, empty)
    expect(page.locator("#notice")).to_have_text("No camera is connected")
    expect(page.locator("#cameras code")).to_contain_text(f"studio camera --source SOURCE --server {empty}")
    expect(page.locator("#takes")).to_contain_text("No takes yet")
    expect(page.locator("#record")).to_be_disabled()
    expect(page.locator("#calibrate")).to_be_disabled()
    expect(page.locator("#calibration-badge")).to_have_text("none")
    page.locator("#switches > summary").click()
    for switch in patient.get(f"{empty}/api/v1/switches").json()["switches"]:
        control = page.locator(f"#switch-{switch['key']}")
        expect(control).to_be_visible()
        expect(page.locator(f"#switch-{switch['key']}-help")).to_contain_text(switch["help"])
    assert page.evaluate(NAMELESS) == []
    assert page.evaluate(FAINT) == []
    page.locator("summary", has_text="Show").click()
    page.get_by_label("Fused skeleton").check()
    page.get_by_label("Trails").check()
    page.get_by_role("button", name="Head").click()
    expect(page.get_by_role("button", name="Head")).to_have_attribute("aria-pressed", "true")
    view = patient.get(f"{empty}/api/v1/view").json()
    assert view["layers"]["fused"]["shown"] and view["layers"]["trails"]["shown"]
    assert "Head" in view["trails"]
    page.select_option("#switch-smoothing", "one_euro:before")
    expect(page.locator("#solve-summary")).to_have_text("1 change")
    until(lambda: patient.get(f"{empty}/api/v1/settings").json()["set"] == {"smoothing": "one_euro:before"})
    page.reload()
    expect(page.locator("#switch-smoothing")).to_have_value("one_euro:before")
    page.get_by_role("button", name="Reset").click()
    expect(page.locator("#solve-summary")).to_have_text("")
    page.select_option("#preset", "thesis")

    def chosen() -> tuple[str, dict[str, str]]:
        settings = patient.get(f"{empty}/api/v1/settings").json()
        return settings["preset"], settings["set"]

    until(lambda: chosen() == ("thesis", {}))


def test_a_refused_value_is_explained_and_taken_back(empty: str, chromium: Browser) -> None:
    page = chromium.new_page()  # the browser itself logs the refused request
    open_page(page, empty)
    page.locator("#switches > summary").click()
    page.fill("#switch-look_at_point_m", "over there")
    page.keyboard.press("Enter")
    expect(page.locator("#messages")).to_contain_text("allowed: x,y,z in metres")
    expect(page.locator("#switch-look_at_point_m")).not_to_have_value("over there")
    page.get_by_role("button", name="Dismiss").click()
    expect(page.locator("#messages")).to_be_empty()
    page.close()


def test_record_solve_and_export(live: str, page: Page, tmp_path: Path) -> None:
    open_page(page, live)
    expect(page.locator("#cameras")).to_contain_text(re.compile("Good|Slow"))  # slow on a busy machine
    page.fill("#take-name", "walk")
    page.locator("#take-name").press("r")  # a letter, not the shortcut
    expect(page.locator("#record .label")).to_have_text("Record")
    page.fill("#take-name", "walk")
    page.locator("h1").click()
    page.keyboard.press("r")
    expect(page.locator("#record .label")).to_have_text("Stop")
    expect(page.locator("#timer")).not_to_have_text("00:00.0")
    page.wait_for_timeout(2000)
    page.locator("#record").click()
    expect(page.locator("#record .label")).to_have_text("Record")
    take = page.locator(".take").filter(has_text="walk")
    expect(take.locator(".solve-row")).to_have_text(["▶liveExportShare×"])
    page.select_option("#preset", "raw")
    take.get_by_role("button", name="Solve walk", exact=True).click()
    expect(take.locator(".solve-row")).to_have_count(2)
    take.get_by_role("button", name="Export walk, solve raw").click()
    dialog = page.get_by_role("dialog")
    page.locator("#export-format").select_option("bvh")
    expect(page.locator("#export-interpolation")).to_be_hidden()  # a BVH has none
    with page.expect_download(timeout=120_000) as download:
        dialog.get_by_role("button", name="Export").click()
    assert download.value.suggested_filename == "walk_raw.bvh"
    assert Path(download.value.path()).read_text().startswith("HIERARCHY")
    expect(dialog).to_be_hidden()
    take.get_by_role("button", name="Export walk, solve raw").click()
    expect(page.locator("#export-format")).to_have_value("bvh")  # as it was the last time
    page.locator("#export-format").select_option("fbx")
    page.locator("#export-advanced > summary").click()
    page.locator("#export-target").select_option("unreal")
    page.locator("#export-root_motion").select_option("root")
    dialog.get_by_label("Lock standing feet").check()
    with page.expect_download(timeout=120_000) as download:
        dialog.get_by_role("button", name="Export").click()
    assert b"ik_hand_gun" in Path(download.value.path()).read_bytes()


def test_r_stops_what_it_began_before_the_server_has_answered(live: str, page: Page) -> None:
    held: list[tuple[Route, APIResponse]] = []
    page.route("**/record/start", lambda route: held.append((route, route.fetch())))
    open_page(page, live)
    expect(page.locator("#record")).to_be_enabled()
    page.keyboard.press("r")
    expect(page.locator("#record .label")).to_have_text("Stop")
    page.keyboard.press("r")
    expect(page.locator("#messages .note")).to_contain_text("recorded")
    until(lambda: page.evaluate("true") and len(held) == 1)  # the browser is heard while it is asked
    held[0][0].fulfill(response=held[0][1])
    expect(page.locator("#record .label")).to_have_text("Record")


def test_a_take_is_named_starred_thrown_away_and_put_back(empty: str, page: Page, tmp_path: Path) -> None:
    take_with_solves(tmp_path / "monday" / "one")
    take_with_solves(tmp_path / "monday" / "two", seed=1)
    page.goto(empty)
    one = page.locator(".take").filter(has_text="one")
    one.get_by_role("button", name="Star one").click()
    expect(one.get_by_role("button", name="Star one")).to_have_attribute("aria-pressed", "true")
    one.get_by_role("button", name="Edit one").click()
    page.locator("#slate-name").fill("best")
    page.locator("#slate-notes").fill("feet are good")
    page.locator("#slate-rating").select_option("4")
    page.get_by_role("button", name="Save", exact=True).click()
    best = page.locator(".take").filter(has_text="best")
    expect(best).to_contain_text("★★★★")
    page.get_by_label("Search takes").fill("feet")
    expect(page.locator(".take")).to_have_count(1)
    page.get_by_label("Search takes").fill("")
    best.get_by_role("button", name="Edit best").click()
    best.get_by_role("button", name="Throw away best").click()
    expect(page.locator(".take")).to_have_count(1)
    wait_for_undos(page, 3)
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    expect(page.locator(".take")).to_have_count(2)
    for name in ("best", "two"):
        page.get_by_label(f"Select {name}").check()
    page.locator("#selected-export").click()
    expect(page.get_by_role("dialog")).to_contain_text("Export 2 takes")


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_nothing_overflows_or_jumps(live: str, page: Page, width: int, height: int) -> None:
    page.set_viewport_size({"width": width, "height": height})
    page.add_init_script(
        "window.shift = 0; new PerformanceObserver((list) => {"
        " for (const entry of list.getEntries()) if (!entry.hadRecentInput) { window.shift += entry.value;"
        " (window.moved ??= []).push([entry.value, ...entry.sources.map(({node, previousRect: from, currentRect: to})"
        " => [node?.nodeName, node?.id, node?.className, from.y, to.y, from.height, to.height])]); } })"
        '.observe({ type: "layout-shift", buffered: true });'
    )
    open_page(page, live)
    expect(page.locator("#cameras .camera")).to_have_count(2)
    expect(page.locator("body")).not_to_have_attribute("data-loading", "")
    page.wait_for_timeout(1500)
    # A layout shift more than half a second after a key counts as unexpected, also on a slow machine.
    assert page.evaluate("window.shift") < 0.1, page.evaluate("window.moved")
    stage = page.locator("#viewer").bounding_box()
    page.keyboard.press("r")
    expect(page.locator("#record .label")).to_have_text("Stop")
    page.keyboard.press("r")
    expect(page.locator("#messages .note")).to_contain_text("recorded")
    expect(page.locator(".take")).to_have_count(1)
    page.wait_for_timeout(500)  # for what would scroll smoothly
    assert page.locator("#viewer").bounding_box() == stage
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    record, viewer = page.locator("#record").bounding_box(), page.locator("#viewer").bounding_box()
    assert record is not None and record["y"] + record["height"] <= height
    assert viewer is not None and viewer["width"] >= 0.6 * width and viewer["height"] >= 0.45 * height
    assert page.evaluate(FAINT) == []


def test_a_server_that_goes_is_noticed_and_found_again(tmp_path: Path, chromium: Browser) -> None:
    page = chromium.new_page()  # failed connections are logged by the browser itself
    with studio(tmp_path) as (app, _):
        with serving(app) as url:
            open_page(page, url)
        expect(page.locator("#connection")).to_have_text("The server does not answer. Trying again")
        expect(page.locator("#record")).to_be_disabled()
        with serving(app, port=int(url.rsplit(":")[-1])):
            expect(page.locator("#connection")).to_have_text("Connected", timeout=60_000)
    page.close()

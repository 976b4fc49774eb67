"""A server is killed and started again while a real browser is open: nothing old is shown as current."""

import io
import json
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from websockets.exceptions import WebSocketException

from tests.acceptance.processes import Proxy, ServerProcess, server_process
from tests.api.camera import Camera
from tests.live.performer import calibration, save_stage_calibration
from tests.web.browser import until
from tests.web.test_page import NAMES
from tests.web.test_view import blocks

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

# Everything visible in the colour for "good", with its pseudo elements.
GREEN = """() => {
  const probe = document.createElement("i");
  document.documentElement.append(probe);
  probe.style.color = "var(--good)";  // of the theme itself: the probe is not in the body
  const good = getComputedStyle(probe).color;
  probe.remove();
  const places = ["color", "backgroundColor", "borderTopColor"];
  const inked = (style) => places.some((place) => style[place] === good);
  return [...document.querySelectorAll("body *")].filter((e) => e.checkVisibility()
      && [null, "::before", "::after"].some((which) => inked(getComputedStyle(e, which))))
    .map((e) => e.outerHTML.slice(0, 120));
}"""


# In the 3D view, before its own program: the names of the nodes of its scene, as they come.
NODES = """window.nodes = new Set();
window.Worker = class extends Worker {
  constructor(...how) {
    super(...how);
    this.addEventListener("message", ({ data }) => { for (const { name } of data.messages ?? []) nodes.add(name); });
  }
};"""


def nodes(page: Page) -> list[str]:
    """Names of the nodes of the scene that the 3D view has got since it was loaded."""
    return page.locator("#viewer").evaluate("frame => [...frame.contentWindow.nodes].map(String)")


def show_times(text: str, seconds: float) -> None:
    """Print a time that was measured: `pytest -s` shows it."""
    print(f"\n{text}: {seconds:.2f} s")


def picture(page: Page) -> np.ndarray:
    """The 3D view as it looks, in blocks of 8 x 8 pixels."""
    with Image.open(io.BytesIO(page.locator("#viewer").screenshot())) as shot:
        return blocks(np.asarray(shot.convert("RGB")).astype(float))


def differs(one: np.ndarray, other: np.ndarray) -> int:
    return int((np.abs(one - other).max(axis=2) > 12).sum())


def moves(page: Page) -> bool:
    """Whether the picture changes by itself."""
    first = picture(page)
    page.wait_for_timeout(300)  # between two pictures
    return differs(first, picture(page)) > 3


def eventually(page: Page, happens: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + 60
    while not happens():
        assert time.monotonic() < end, f"waited in vain until {what}"
        page.wait_for_timeout(50)


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    """A page without errors of its own: connections that fail are logged by the browser itself."""
    errors: list[str] = []
    tab = chromium.new_page(viewport={"width": 1280, "height": 720})
    tab.on("pageerror", lambda error: errors.append(str(error)))
    yield tab
    tab.close()
    assert errors == []


@contextmanager
def performing(url: str) -> Iterator[None]:
    """Two cameras see the made-up performer at 30 Hz, and come again whenever the server goes and comes."""
    stop = threading.Event()

    def perform() -> None:
        while not stop.is_set():
            try:
                with ExitStack() as links:
                    link = f"{url.replace('http', 'ws')}/api/v1/link"
                    cameras = [links.enter_context(Camera(link, index)) for index in range(2)]
                    for camera in cameras:
                        camera.greet()
                        camera.exchange_clocks()
                    while not stop.wait(1 / 30):
                        for camera in cameras:
                            camera.send_frame()
            except (OSError, WebSocketException):
                stop.wait(0.2)

    thread = threading.Thread(target=perform)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@contextmanager
def calibrated_server(folder: Path) -> Iterator[ServerProcess]:
    """A server with the calibration of two cameras."""
    save_stage_calibration(folder / "sessions", NAMES)
    with server_process(folder / "sessions") as process:
        yield process


@pytest.fixture
def own_server(tmp_path: Path) -> Iterator[ServerProcess]:
    """A server for a test that changes its calibration."""
    with calibrated_server(tmp_path) as process:
        yield process


@pytest.fixture(scope="module")
def one_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    """A server for all tests that change nothing of what it keeps."""
    with calibrated_server(tmp_path_factory.mktemp("one")) as process:
        yield process


@pytest.fixture
def server(one_server: ServerProcess) -> ServerProcess:
    """The server; it is started again if the test before killed it."""
    assert one_server.process is not None
    if one_server.process.poll() is not None:
        one_server.start()
    return one_server


def place_other_cameras(sessions: Path) -> None:
    """Have the next server begin with a calibration of five cameras."""
    cameras = [f"camera_{index}" for index in range(5)]
    (sessions / "calibrations" / "1.json").write_text(json.dumps(calibration(cameras).to_json()))


@pytest.mark.lively
def test_the_view_comes_back_with_a_server_that_was_killed(own_server: ServerProcess, page: Page) -> None:
    page.add_init_script(NODES)
    page.set_viewport_size({"width": 640, "height": 480})  # few pixels, which are drawn all the time
    page.goto(own_server.url)
    page.locator("#theme").focus()  # the focus is on the page, not in the 3D view
    with performing(own_server.url):
        expect(page.locator("#cameras .health")).to_have_text(["Good"] * 2)
        eventually(page, lambda: "/cameras/camera_1" in nodes(page), "the cameras are drawn")
        eventually(page, lambda: moves(page), "somebody moves")
        assert "/cameras/camera_4" not in nodes(page)
        assert page.evaluate(GREEN) != []
        began = time.monotonic()
        own_server.kill()
        expect(page.locator("#curtain")).to_contain_text("Not live since")
        expect(page.locator("#cameras .health")).to_have_text(["Unknown"] * 2)
        assert page.evaluate(GREEN) == []
        show_times("killed server: nothing green, told over the picture after", time.monotonic() - began)
        expect(page.locator("#timer")).to_have_text("–")
        expect(page.locator("#disk")).to_have_text("–")
        assert "grayscale" in page.locator("#viewer").evaluate("e => getComputedStyle(e).filter")
        place_other_cameras(own_server.sessions)
        own_server.start()
        began = time.monotonic()
        expect(page.locator("#curtain")).to_be_hidden()
        show_times("started again: the view is of now after", time.monotonic() - began)
        eventually(page, lambda: moves(page), "somebody moves again")
        show_times("and moves after", time.monotonic() - began)
        eventually(page, lambda: "/cameras/camera_4" in nodes(page), "the new cameras are drawn")
        expect(page.locator("#cameras .health")).to_have_text(["Good"] * 2)


IS_THE_FIRST = "frame => frame.contentWindow.isTheFirst === true"


@pytest.mark.viewing
def test_a_server_that_is_busy_for_seconds_or_a_page_that_is_does_not_have_the_view_loaded_anew(
    server: ServerProcess, page: Page
) -> None:
    page.goto(server.url)
    expect(page.locator("#connection")).to_have_text("Connected")
    until(page, "!!document.querySelector('#viewer').contentDocument.querySelector('canvas')")
    expect(page.locator("#curtain")).to_be_hidden()
    page.locator("#viewer").evaluate("frame => { frame.contentWindow.isTheFirst = true; }")
    assert server.process is not None
    server.process.send_signal(signal.SIGSTOP)
    expect(page.locator("#curtain")).to_contain_text("Not live since")
    page.wait_for_timeout(1500)  # longer than a view waits whose link has ended
    server.process.send_signal(signal.SIGCONT)
    expect(page.locator("#curtain")).to_be_hidden()
    page.wait_for_timeout(1500)
    assert page.locator("#viewer").evaluate(IS_THE_FIRST)
    page.evaluate("""() => {  // the page itself stands still for as long as a view would be given up
      const now = performance.now.bind(performance);
      performance.now = () => now() + 8000;
    }""")
    page.wait_for_timeout(1500)
    assert page.locator("#viewer").evaluate(IS_THE_FIRST)


@pytest.mark.viewing
def test_a_link_that_is_cut_without_a_word_is_noticed_and_made_anew(
    server: ServerProcess, page: Page
) -> None:
    cable = Proxy(server.port)
    page.goto(f"http://127.0.0.1:{cable.port}")
    expect(page.locator("#connection")).to_have_text("Connected")
    until(page, "!!document.querySelector('#viewer').contentDocument.querySelector('canvas')")
    began = time.monotonic()
    cable.cut(silently=True)
    expect(page.locator("#curtain")).to_contain_text("Not live since")
    assert page.evaluate(GREEN) == []
    show_times("pulled cable: told over the picture after", time.monotonic() - began)
    cable.mend()
    began = time.monotonic()
    expect(page.locator("#connection")).to_have_text("Connected")
    expect(page.locator("#curtain")).to_be_hidden()
    show_times("mended cable: all is of now after", time.monotonic() - began)
    cable.close()


def test_a_page_of_a_server_that_no_longer_knows_it_says_to_sign_in_again(
    tmp_path: Path, chromium: Browser
) -> None:
    with ExitStack() as opened, server_process(tmp_path / "sessions", "--host", "0.0.0.0") as server:
        pages = {path: opened.enter_context(chromium.new_context()).new_page() for path in ("/", "/remote")}
        for path, page in pages.items():
            page.goto(f"{server.url}{path}")
            page.fill("#token", server.operator_token())
            page.click("button[type=submit]")
            expect(page.locator("#connection")).to_have_text("Connected")
        server.kill()
        for page in pages.values():
            expect(page.locator("#connection")).to_contain_text("does not answer")
        server.start()
        for path, page in pages.items():
            expect(page.locator("#again")).to_contain_text("Sign in again")
            page.fill("#token", server.operator_token())
            page.click("button[type=submit]")
            expect(page).to_have_url(f"{server.url}{path}")
            expect(page.locator("#connection")).to_have_text("Connected")


def test_remote_and_wizard_do_not_know_either(server: ServerProcess, page: Page, chromium: Browser) -> None:
    remote = chromium.new_page(viewport={"width": 390, "height": 844})
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(server.url)
    remote.goto(f"{server.url}/remote")
    with performing(server.url):
        expect(page.locator("#calibrate")).to_be_enabled()
        page.locator("#calibrate").click()
        said = {page: page.locator("#wizard-big"), remote: remote.locator("#big")}
        for tab, big in said.items():
            expect(big).to_contain_text("2 cameras ready")
            assert tab.evaluate(GREEN) != []
        server.kill()
        for tab, big in said.items():
            expect(big).to_have_text("Unknown")
            assert tab.evaluate(GREEN) == []
            for button in tab.locator("#record, #wizard-walk").all():
                expect(button).to_be_disabled()
        server.start()
        for big in said.values():
            expect(big).to_contain_text("2 cameras ready")
    remote.close()


def test_the_clock_is_asked_for_ever_less_while_it_does_not_answer(server: ServerProcess, page: Page) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(urlsplit(request.url).path.rsplit("/")[-1]))
    page.goto(server.url)
    expect(page.locator("#connection")).to_have_text("Connected")
    eventually(page, lambda: asked.count("clock") == 8, "the clocks are known")
    server.kill()
    asked.clear()
    eventually(page, lambda: asked.count("access") == 12, "it was tried so often whether the server is back")
    assert asked.count("clock") <= 6

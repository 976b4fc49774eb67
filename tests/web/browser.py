"""A real Chromium with WebGL in software."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, expect, sync_playwright

from tests.acceptance.processes import wait_until

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
"""The first is Chromium without the parts for a window; opening the page takes half the processor time."""

CHROMIUM = Path(next(filter(None, map(shutil.which, NAMES)), ""))
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",  # WebGL by software, the page itself cheaper
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
]  # fmt: skip
WAIT_MS = 60_000
"""How long whatever is waited for may take: a machine that is busy is slow, not wrong."""

SELDOM_MS, LIVELY_MS = 1000, 200
View = Literal["absent", "still", "moving", "drawn"]
UNHURRIED = """const draws = /^\\/(vote|share)\\//.test(location.pathname) || location.protocol === "file:";
if (location.pathname.startsWith("/viewer") && "HOW" === "absent") {
  stop();
} else if (location.pathname.startsWith("/viewer") || draws) {
  const next = window.requestAnimationFrame.bind(window), gl = WebGL2RenderingContext.prototype;
  window.requestAnimationFrame = (call) => (draws || "HOW" !== "still") && setTimeout(() => next(call), INTERVAL_MS);
  if ("HOW" === "moving" && !draws) {
    const { viewport } = gl;
    gl.viewport = function (x, y, width, height) {
      this.isTrial = width < 16;  // of what the browser can do, before the first picture
      viewport.call(this, x, y, width, height);
    };
    for (const name of ["clear", "drawArrays", "drawArraysInstanced", "drawElements", "drawElementsInstanced"]) {
      const draw = gl[name];
      gl[name] = function (...how) {
        if (this.isTrial) draw.apply(this, how);
      };
    }
  }
  if (!location.search.includes("software")) {
    const { getContext } = HTMLCanvasElement.prototype, { getParameter } = gl;
    HTMLCanvasElement.prototype.getContext = function (kind, how) {
      return getContext.call(this, kind, how?.antialias ? { ...how, antialias: false } : how);
    };
    gl.getParameter = function (name) {
      return name === 0x9246 ? "a graphics card" : getParameter.call(this, name);  // UNMASKED_RENDERER_WEBGL
    };
  }
}"""
"""How a page's 3D view is.

`drawn`: five frames a second without multisampling, because drawing by software takes a core from all other tests.
`moving`: as many empty frames; its camera moves, and a click meets what is there.
`still`: its program runs, gets all messages and waits for its first frame, which would take three seconds.
`absent`: its program is not loaded, which is half the cost of opening the page.

A page that shows animations alone, of a vote or of a share, is always `drawn`.

The view takes the browser for one with a graphics card, so that pictures of one test have the same resolution; where
`?software` is asked for, it knows.
"""

expect.set_options(timeout=WAIT_MS)

_view: View = "still"
_interval_ms = LIVELY_MS


@contextmanager
def views_that_are(view: View, *, interval_ms: int = LIVELY_MS) -> Iterator[None]:
    """The 3D views of pages that are opened in the block are so, with a frame in each interval."""
    global _view, _interval_ms
    before, _view, _interval_ms = (_view, _interval_ms), view, interval_ms
    yield
    _view, _interval_ms = before


@contextmanager
def chromium_browser() -> Iterator[Browser]:
    """A browser while the block runs; a skip where there is no Chromium."""
    if not CHROMIUM.is_file():
        pytest.skip("no Chromium on this machine")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        _make_patient(browser)
        yield browser
        browser.close()


def _make_patient(browser: Browser) -> None:
    """Have all pages of the browser wait so long for what they are told to do, and nothing move for its looks."""

    def patient(new: Callable[..., Page | BrowserContext]) -> Callable[..., Page | BrowserContext]:
        def opened(**options: Any) -> Page | BrowserContext:
            made = new(**{"reduced_motion": "reduce", **options})
            made.set_default_timeout(WAIT_MS)
            made.add_init_script(UNHURRIED.replace("INTERVAL_MS", str(_interval_ms)).replace("HOW", _view))
            return made

        return opened

    browser.new_page = patient(browser.new_page)
    browser.new_context = patient(browser.new_context)


def _complains(message: ConsoleMessage) -> bool:
    """Whether the page complains.

    Notes of the software renderer on its own speed are not the page's, nor is a picture of a take that was renamed
    between the list and the picture, or a search that is refused: the browser logs every answer of 404 and 422. The
    server of a test may end a moment before its page, which asks for its clock and for access.
    """
    renamed = "404" in message.text and "/thumbnail?" in message.location.get("url", "")
    refused = "422" in message.text and "/takes?search=" in message.location.get("url", "")
    asked = message.location.get("url", "")
    ended = "ERR_CONNECTION_REFUSED" in message.text and asked.split("?")[0].endswith(
        ("/view/clock", "/access")
    )
    slow = "GL Driver Message (OpenGL, Performance" in message.text
    return message.type in ("error", "warning") and not (slow or renamed or refused or ended)


@contextmanager
def quiet_page(browser: Browser) -> Iterator[Page]:
    """A page of 1280x720 that must not complain: errors and warnings on its console fail the test."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(f"{error} {error.stack}"))
    page.on(
        "console",
        lambda message: (
            complaints.append(f"{message.text} {message.location['url']}") if _complains(message) else None
        ),
    )
    yield page
    page.close()
    assert not complaints, complaints


def until(page: Page, condition: str) -> None:
    """Wait until a condition holds in a page, whose policy forbids the `eval` that Playwright's own waiting needs."""
    wait_until(lambda: page.evaluate(condition), condition)


def wait_for_undos(page: Page, count: int) -> None:
    """Wait until the page knows so many acts that Ctrl+Z takes back: the server has answered them all."""
    until(page, f"JSON.parse(sessionStorage.getItem('undos') ?? '[]').length === {count}")

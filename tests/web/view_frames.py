"""`python -m tests.web.view_frames [SECONDS]`: what the 3D view costs Chromium, which draws it by software.

Starts the real server with a take, replays it in a loop at 1280x720, then pauses it, then shows the live stage
without anybody. Prints pictures of the view a second, and CPU time of all processes of Chromium: for a picture, and
of a core.
"""

import sys
import tempfile
import time
from pathlib import Path

import psutil
from playwright.sync_api import Page, sync_playwright

from tests import patient
from tests.acceptance.processes import server_process
from tests.web.browser import CHROMIUM, FLAGS
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until

SETTLED_MS = 15_000
DRAWN = """() => {
  const { scene, canvas } = document.getElementById("viewer").contentWindow.__viserMutable ?? {};
  return scene?.__r3f && [scene.__r3f.root.getState().gl.info.render.frame, canvas.width, canvas.height];
}"""


def chromium_cpu_s() -> float:
    """CPU time that Chromium's processes below this one have used [s]."""
    used = 0.0
    for process in psutil.Process().children(recursive=True):
        try:
            if "chrom" in Path(process.exe()).name:
                used += sum(process.cpu_times()[:2])
        except psutil.Error:
            continue
    return used


def measure(page: Page, what: str, seconds: float) -> None:
    until(lambda: bool(page.evaluate(DRAWN)), 120.0)
    page.wait_for_timeout(SETTLED_MS)
    before, begin_s, begin_cpu_s = page.evaluate(DRAWN)[0], time.monotonic(), chromium_cpu_s()
    page.wait_for_timeout(1000 * seconds)
    cpu_s, passed_s = chromium_cpu_s() - begin_cpu_s, time.monotonic() - begin_s
    drawn, width, height = page.evaluate(DRAWN)
    count = drawn - before
    each = f"{1e3 * cpu_s / count:.0f} ms of CPU each" if count else "none"
    print(f"{what}: {count / passed_s:.1f} pictures a second of {width}x{height}, {each}; "
          f"{100 * cpu_s / passed_s:.0f} % of a core", flush=True)  # fmt: skip


def main(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        sessions = Path(folder) / "sessions"
        take_with_solves(sessions / "monday" / "one")
        with server_process(sessions) as server:
            browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(server.url)
            replay = f"{server.url}/api/v1/replay"
            patient.put(replay, json={"take": "monday/one", "solve": "studio"}).raise_for_status()
            patient.patch(replay, json={"playing": True, "loop": True}).raise_for_status()
            measure(page, "replayed", seconds)
            patient.patch(replay, json={"playing": False}).raise_for_status()
            measure(page, "paused", seconds)
            patient.delete(replay).raise_for_status()
            measure(page, "live, nobody there", seconds)
            browser.close()


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)

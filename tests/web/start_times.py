"""`python -m tests.web.start_times CLONE [TIMES]`: how soon `./start` shows a figure that moves.

Starts the studio with its cameras in a clone that is installed, opens its page in Chromium, which draws by software,
and prints the times since `./start` [s]: the server answers, the view's first picture, five pictures of a body that
has moved. Where it had to compile first, they count from when that was done.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

from tests import patient
from tests.acceptance.processes import free_port, wait_until
from tests.web.browser import CHROMIUM, FLAGS

PATIENCE_S = 120.0
PICTURES = 5
"""Pictures with a body, after which it is said to move: the first one may be drawn for long."""
SEEN = """() => {
  const { scene } = document.getElementById("viewer")?.contentWindow?.__viserMutable ?? {};
  const pictures = scene?.__r3f?.root?.getState().gl.info.render.frame ?? 0;
  let pose = null;
  scene?.traverseVisible((one) => {
    if (one.isSkinnedMesh) pose = String(one.skeleton.bones.map((bone) => bone.matrixWorld.elements.slice(12)));
  });
  return [pictures, pose];
}"""


def measure(clone: Path, browser: Browser) -> dict[str, float]:
    """Return the times of one start [s]."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    begun_s = time.time()
    studio = subprocess.Popen(
        ["./start", "--port", str(port)], cwd=clone, stdout=subprocess.DEVNULL, start_new_session=True
    )
    found: dict[str, float] = {}
    first: tuple[int, str] | None = None

    def answers() -> bool:
        assert studio.poll() is None, "the studio has ended; its messages are above"
        return patient.get(f"{url}/api/v1/status").is_success

    def moves() -> bool:
        nonlocal first
        pictures, pose = page.evaluate(SEEN)
        if pictures:
            found.setdefault("first picture", time.time() - begun_s)
        if pose and first is None:
            first = pictures, pose
        return first is not None and pictures >= first[0] + PICTURES and pose != first[1]

    try:
        wait_until(answers, "the server answers")
        begun_s = max(begun_s, (clone / ".venv" / "prepared").stat().st_mtime)
        found["server"] = time.time() - begun_s
        page.goto(url, wait_until="commit")
        wait_until(moves, "a figure moves", PATIENCE_S)
        found["moves"] = time.time() - begun_s
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(studio.pid, signal.SIGINT)
        studio.wait(30)
        page.close()
    return found


def main(clone: Path, times: int) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        for _ in range(times):
            print({what: round(time_s, 1) for what, time_s in measure(clone, browser).items()}, flush=True)
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 3)

"""`python -m tests.web.points.cost TAKE SOLVE [SECONDS]`: what points cost server and Chromium.

Prints the CPU time of a camera's cloud, part by part. Then replays the take and counts the browser's pictures without
points, with points by camera and by confidence.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, expect

from studio.take.folder.take import Take
from studio.take.raw.depth import DepthReader, index_depth
from studio.web.playback.clip import Clip
from studio.web.points.colours import by_confidence
from studio.web.points.maker import COLOURS, points_each
from studio.web.points.thinning import StageSpace, Thinner
from tests import patient
from tests.web.browser import chromium_browser
from tests.web.stages import serving
from tests.web.test_page import studio

FRAMES = """(ms) => new Promise((done) => {
  let count = 0;
  const begin = performance.now();
  const next = () => {
    count += 1;
    const passed = performance.now() - begin;
    if (passed < ms) frame.requestAnimationFrame(next);
    else done(1000 * count / passed);
  };
  const frame = document.getElementById("viewer").contentWindow;
  frame.requestAnimationFrame(next);
})"""


def cpu_ms(function: Callable[[], object], repeats: int = 60) -> float:
    """CPU time of a call in this thread [ms]."""
    function()
    begin = time.thread_time()
    for _ in range(repeats):
        function()
    return 1e3 * (time.thread_time() - begin) / repeats


def parts(take: Take, solve: str) -> None:
    """Print the CPU time of a camera's cloud, part by part."""
    clip = Clip.load(take, solve)
    recording = index_depth(take.raw_path)
    name = next(iter(recording.cameras))
    joints = clip.poses.positions_m[0, :21]
    with DepthReader(recording) as reader:
        count = len(recording.times_ns(name))
        numbers = iter(range(10**9))
        decode = cpu_ms(lambda: reader.image(name, next(numbers) % count))
        image = reader.image(name, 0)
    assert image is not None
    thinner, (T, _) = Thinner(recording.cameras[name]), clip.depth.placed[name]
    near, each = StageSpace.about(joints, 0.3), points_each("confidence", len(recording.cameras))
    thin = cpu_ms(lambda: thinner.points(image.depth_mm, T, each, near))
    points = thinner.points(image.depth_mm, T, each, near)
    colour = cpu_ms(lambda: by_confidence(points, joints, np.ones(21)))
    print(
        f"{name} of {len(recording.cameras)}, {image.depth_mm.shape}: decode {decode:.2f} ms, thin {thin:.2f} ms, "
        f"confidence of {each} points {colour:.2f} ms"
    )


def pictures(page: Page, seconds: float) -> float:
    page.wait_for_timeout(3000)
    return page.evaluate(FRAMES, 1000 * seconds)


def main(take_path: Path, solve: str, seconds: float) -> None:
    take = Take.open(take_path)
    parts(take, solve)
    id_ = f"{take_path.parent.name}/{take_path.name}"
    with studio(take_path.parent.parent) as (app, _), serving(app) as url, chromium_browser() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(url)
        patient.put(f"{url}/api/v1/replay", json={"take": id_, "solve": solve}).raise_for_status()
        patient.patch(f"{url}/api/v1/replay", json={"playing": True})
        patient.put(f"{url}/api/v1/view", json={"layers": {"points": True}})
        expect(page.locator("#points-said")).to_contain_text("fps")
        for _ in range(2):
            for colour in ("", *COLOURS):
                patient.put(
                    f"{url}/api/v1/view",
                    json={"layers": {"points": bool(colour)}, "points": {"colour": colour or "camera"}},
                )
                begin = time.process_time()
                rate = pictures(page, seconds)
                share = (time.process_time() - begin) / (seconds + 3.0)
                said = page.locator("#points-said").inner_text() if colour else "no points"
                print(f"{said}: {rate:.1f} pictures a second, {100 * share:.0f} % of a core here", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 10.0)

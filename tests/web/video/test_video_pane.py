"""The video beside the replay: in step with it in a real browser, with landmarks and the solved skeleton over it."""

import json

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from studio.engine.model.poses import Poses, on_output_joints
from studio.take.folder.take import Take
from tests import patient
from tests.take.video_takes import (
    BITS,
    COUNT,
    HEIGHT,
    LENS,
    RATE_HZ,
    WIDTH,
    calibration,
    landmark_pixels,
    number_in,
    take_with_video,
)
from tests.web.playback.takes import add_picture
from tests.web.stages import until
from tests.web.test_page import serving, studio

pytestmark = pytest.mark.browser

CANVAS = "#video-canvas"
COPY = """const pen = new OffscreenCanvas(canvas.width, HEIGHT).getContext("2d", { willReadFrequently: true });
  pen.drawImage(canvas, 0, -TOP);"""
"""Copies so many rows of a canvas, from a row on."""
BARS = f"""(canvas) => {{
  const place = JSON.parse(canvas.dataset.place), by = devicePixelRatio;
  const top = Math.trunc(by * (place.top + 20 / {HEIGHT} * place.height));
  {COPY.replace("HEIGHT", "1").replace("TOP", "top")}
  const left = (bit) => by * (place.left + (bit * 20 + 10) / {WIDTH} * place.width);
  return [...Array({BITS}).keys()].map((bit) => pen.getImageData(left(bit), 0, 1, 1).data[1]);
}}"""
"""The brightness of the bars that tell a picture's number."""
SEEN = f"""(ms) => new Promise((done) => {{
  const bars = {BARS}, canvas = document.querySelector("{CANVAS}"), seen = [], began = performance.now();
  const frames = new Set();
  let before = 0, loops = false;
  const look = () => {{
    if (canvas.dataset.picture) {{
      const frame = Number(canvas.dataset.frame);
      loops ||= frame < before;
      before = frame;
      frames.add(frame);
      seen.push([frame, bars(canvas)]);
    }}
    const enough = loops && frames.size > 20;
    performance.now() - began < ms && !enough ? requestAnimationFrame(look) : done(seen);
  }};
  look();
}})"""
"""The frames that are shown and their bars, until 20 were seen and the loop has begun anew, or so long."""
COLOURS = """(canvas) => {
  COPY
  const { data } = pen.getImageData(0, 0, canvas.width, canvas.height), found = { landmarks: 0, skeleton: 0 };
  for (let at = 0; at < data.length; at += 4) {
    const r = data[at], g = data[at + 1], b = data[at + 2];
    if (r > 200 && g > 140 && g < 210 && b < 130) found.landmarks += 1;
    if (r < 130 && g > 190 && b > 150 && b < 225) found.skeleton += 1;
  }
  return found;
}""".replace("COPY", COPY.replace("HEIGHT", "canvas.height").replace("TOP", "0"))


@pytest.fixture
def take(tmp_path) -> Take:
    take = take_with_video(tmp_path / "sessions" / "monday" / "one")
    add_picture(take)
    return take


@pytest.fixture
def address(take: Take):
    with studio(take.path.parents[1]) as (app, _), serving(app) as url:
        yield url


def poses_of(take: Take) -> Poses:
    return on_output_joints(Poses.load(take.solve_folder("studio") / "poses.npz"))


def open_video(address: str, page: Page) -> None:
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#replay-time")).to_contain_text("/")
    page.keyboard.press("v")
    expect(page.locator(f"{CANVAS}[data-picture]")).to_be_visible()


def shown_number(page: Page, frame: int) -> int:
    """The number in the picture that is shown at a frame, once it has come."""
    page.locator(f"{CANVAS}[data-frame='{frame}']").wait_for()
    return number_in(np.array(page.locator(CANVAS).evaluate(BARS), float))


def expected(take: Take, frame: int) -> float:
    """The picture of a frame of the replay, in pictures."""
    return float(poses_of(take).time_s[frame]) * RATE_HZ


def test_the_picture_keeps_step_and_the_solve_is_drawn_over_it(take: Take, address: str, page: Page) -> None:
    open_video(address, page)
    landmarks_and_skeleton_are_drawn_where_the_lens_has_them(take, address, page)
    the_picture_is_that_of_the_frame(take, address, page)
    while_it_plays_in_a_loop_the_picture_keeps_step(take, page)
    a_camera_without_video_says_why(page)


def landmarks_and_skeleton_are_drawn_where_the_lens_has_them(take: Take, address: str, page: Page) -> None:
    until(lambda: min(page.locator(CANVAS).evaluate(COLOURS).values()) > 20)
    page.locator("#video-skeleton").uncheck()
    until(lambda: page.locator(CANVAS).evaluate(COLOURS)["skeleton"] == 0)
    assert page.locator(CANVAS).evaluate(COLOURS)["landmarks"] > 20
    page.locator("#video-landmarks").uncheck()
    until(lambda: page.locator(CANVAS).evaluate(COLOURS) == {"landmarks": 0, "skeleton": 0})

    size = np.array([LENS.width, LENS.height])
    drawn = patient.get(f"{address}/api/v1/replay/video/left/drawn?first=20&last=24").json()
    assert drawn["first"] == 20 and len(drawn["landmarks"]) == len(drawn["skeleton"]) == 5
    found = np.array(drawn["landmarks"][2]).reshape(-1, 2) / 1e4 * size - 0.5
    np.testing.assert_allclose(found, landmark_pixels(22), atol=0.05)
    poses, camera = poses_of(take), calibration().cameras["left"]
    time_s = 22 / RATE_HZ
    joints = np.stack(
        [[np.interp(time_s, poses.time_s, poses.positions_m[:, j, a]) for a in range(3)] for j in range(52)]
    )
    T_camera_stage = np.linalg.inv(camera.T_stage_camera)
    pixels = LENS.pixels_of(joints @ T_camera_stage[:3, :3].T + T_camera_stage[:3, 3])
    found = np.array(drawn["skeleton"][2], float).reshape(-1, 2) / 1e4 * size - 0.5
    near = np.isfinite(found).all(axis=1)
    assert near.sum() > 40
    np.testing.assert_allclose(found[near], pixels[near], atol=0.05)


def the_picture_is_that_of_the_frame(take: Take, address: str, page: Page) -> None:
    frames = poses_of(take).frame_count
    assert abs(shown_number(page, 0) - expected(take, 0)) <= 1.0
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    assert abs(shown_number(page, 11) - expected(take, 11)) <= 1.0
    page.keyboard.press("ArrowLeft")
    assert abs(shown_number(page, 10) - expected(take, 10)) <= 1.0
    page.keyboard.press("End")
    assert abs(shown_number(page, frames - 1) - expected(take, frames - 1)) <= 1.0
    box = page.locator("#timeline").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.55 * box["width"], box["y"] + 20)
    until(
        lambda: (
            page.evaluate("true")
            and 20 < patient.get(f"{address}/api/v1/replay").json()["frame"] < frames - 9
        )
    )
    frame = patient.get(f"{address}/api/v1/replay").json()["frame"]
    assert abs(shown_number(page, frame) - expected(take, frame)) <= 1.0
    page.keyboard.press("Home")
    assert abs(shown_number(page, 0) - expected(take, 0)) <= 1.0


def while_it_plays_in_a_loop_the_picture_keeps_step(take: Take, page: Page) -> None:
    for speed in ("0.5", "2"):
        page.locator("#replay-speed").select_option(speed)
        page.locator(CANVAS).click()
        page.keyboard.press("Space")
        seen = page.evaluate(SEEN, 6000)
        page.keyboard.press("Space")
        assert len({frame for frame, _ in seen}) > 5
        for frame, bars in seen:  # what is drawn is of the frame for which it was drawn
            assert abs(number_in(np.array(bars, float)) - expected(take, frame)) <= 1.5, frame


def a_camera_without_video_says_why(page: Page) -> None:
    page.locator("#video-camera").select_option("right")
    expect(page.locator("#video-said")).to_contain_text("the take keeps no video of right")
    page.evaluate("localStorage.setItem('language', 'fr')")
    page.reload()
    expect(page.locator("#video-said")).to_contain_text("aucune vidéo de right")
    page.locator("#video-close").click()
    expect(page.locator("#video")).to_be_hidden()
    with page.expect_response("**/replay/video"):  # all that it asks for is there before the replay ends
        page.keyboard.press("v")
    expect(page.locator("#video-said")).to_contain_text("aucune vidéo de right")
    page.keyboard.press("Escape")
    expect(page.locator("#video")).to_be_hidden()


def test_without_a_solve_there_are_landmarks_only(tmp_path, page: Page) -> None:
    take_with_video(tmp_path / "sessions" / "monday" / "one", solved=False, calibrated=False, suffix=".webm")
    with studio(tmp_path / "sessions") as (app, _), serving(app) as address:
        page.goto(address)
        page.get_by_role("button", name="Open one").click()
        page.locator("#replay-video").click()
        until(lambda: page.locator(f"{CANVAS}[data-picture]").count() == 1)
        until(lambda: page.locator(CANVAS).evaluate(COLOURS)["landmarks"] > 20)
        expect(page.locator("#video-skeleton")).to_be_disabled()
        expect(page.locator("label:has(#video-skeleton)")).to_have_attribute(
            "title", "without a solve there is no skeleton to draw; solve the take"
        )
        page.locator("#video-landmarks").uncheck()
        page.keyboard.press("Shift+ArrowRight")
        assert (
            abs(shown_number(page, 10) - 10) <= 1
        )  # without a calibration the replay has 30 frames a second
        page.goto("about:blank")  # the server ends before the page, which asks for more pictures


def test_a_video_that_is_damaged_is_said(take: Take, address: str, chromium: Browser) -> None:
    (take.path / "video" / "left" / "00001.mp4").write_bytes(b"no video")
    page = chromium.new_page()  # its console tells the refused pictures
    page.goto(address)
    page.get_by_role("button", name="Replay one, solve studio").click()
    expect(page.locator("#replay-time")).to_contain_text("/")
    page.keyboard.press("v")
    expect(page.locator("#video-said")).to_contain_text("00001.mp4 is no video that can be read")
    page.close()


def test_the_video_is_deleted_and_comes_back(take: Take, address: str, page: Page) -> None:
    page.goto(address)
    row = page.locator("[data-take='monday/one']")
    expect(row).to_contain_text("video ")
    row.get_by_role("button", name="Edit one").click()
    row.get_by_role("button", name="Delete the video").click()
    expect(page.locator("#messages")).to_contain_text("The video of one is in the trash")
    assert not (take.path / "video").exists() and (take.path / "raw.mcap").exists()
    page.keyboard.press("Control+z")
    until(lambda: page.evaluate("true") and (take.path / "video" / "left" / "00001.mp4").is_file())


def test_what_is_not_there_is_not_found(address: str) -> None:
    pictures = f"{address}/api/v1/takes/monday/one/video"
    assert patient.get(f"{pictures}/left/pictures/3?width=70").headers["content-type"] == "image/jpeg"
    for path in (f"left/pictures/{COUNT}", "left/pictures/-1", "right/pictures/0", "..%2Fleft/pictures/0"):
        assert patient.get(f"{pictures}/{path}").status_code == 404, path
    assert patient.get(f"{pictures}/left/pictures/0?width=9000").status_code == 422
    assert patient.get(f"{address}/api/v1/replay/video").status_code >= 400
    assert json.loads(patient.get(f"{pictures}/right/pictures/0").text)["error"]["code"] == "not_found"

"""The video of a phone: recorded during takes, in step to the picture, kept until the studio has it."""

import struct

import av
import numpy as np
import pytest
from playwright.sync_api import expect

from studio.take.video.file import VideoFile
from studio.take.video.kept import KeptVideo, kept_videos
from tests.acceptance.processes import wait_until
from tests.take.video_takes import BITS, number_in, numbered_pictures
from tests.web.browser import quiet_page, until
from tests.web.phones import as_counter, phone
from tests.web.test_phone_page import is_told, studio  # noqa: F401

pytestmark = pytest.mark.browser

WATCHED = """() => {
  const video = document.querySelector("#video"), canvas = new OffscreenCanvas(140, 160);
  const pen = canvas.getContext("2d", { willReadFrequently: true });
  window.seen = [];
  const see = (begin, { captureTime, mediaTime }) => {
    video.requestVideoFrameCallback(see);
    if (video.readyState < HTMLMediaElement.HAVE_CURRENT_DATA) return; // its stream ended meanwhile
    const picture = new VideoFrame(video), later_ms = picture.timestamp / 1e3 - mediaTime * 1e3;
    pen.drawImage(picture, 0, 0);
    picture.close();
    const { data } = pen.getImageData(0, 20, 140, 1);
    const bits = Array.from({ length: 7 }, (_, bit) => data[4 * (20 * bit + 10)]);
    window.seen.push([Math.round(1e6 * (captureTime ?? begin)) + Math.round(1e6 * later_ms), bits]);
  };
  video.requestVideoFrameCallback(see);
}"""
"""Notes the number in each picture that the page shows, and its time, beside what the page itself does."""

BUSY = """() => {
  const video = document.querySelector("#video"), next = video.requestVideoFrameCallback.bind(video);
  let count = 0;
  video.requestVideoFrameCallback = (call) => next((...told) => {
    const until = performance.now() + 130;
    if ((count += 1) % 5 === 0) while (performance.now() < until);
    call(...told);
  });
  let made = 0;
  window.VideoFrame = class extends VideoFrame {
    constructor(source, how) {
      const until = performance.now() + 130;
      if (how && (made += 1) % 5 === 0) while (performance.now() < until);
      super(source, how);
    }
  };
}"""
"""Holds the page between a picture that is announced and what it does with it, and between its time and its
recording: by then there is a later one."""


def start(one, url, *scripts):
    """Start the camera, with its video kept; scripts run in the page before."""
    one.open(f"{url}/phone", "stand")
    one.page.evaluate("() => localStorage.setItem('phone-keep-video', 'yes')")
    one.page.reload()
    one.page.fill("#name", "stand")
    for script in scripts:
        one.page.evaluate(script)
    one.page.click("#start")
    one.sends(3)


def videos_of(sessions) -> list[KeptVideo]:
    (take,) = sessions.glob("*/*/raw.mcap")
    return kept_videos(take.parent).get("stand", [])


def numbers_in(video: KeptVideo, *, mirrored: bool = False) -> dict[int, int]:
    """Number of each picture of a video by its time [ns]."""
    frames = [frame for _, frame in VideoFile.open(video.path).frames()]
    assert len(frames) == len(video.times_ns)
    rows = [frame.to_ndarray(format="gray")[20, 10 : 20 * BITS : 20].astype(float) for frame in frames]
    rows = [row[::-1] if mirrored else row for row in rows]
    return {time_ns: number_in(row) for time_ns, row in zip(video.times_ns.tolist(), rows, strict=True)}


def test_a_video_is_in_step_and_outlives_its_page(studio, chromium, tmp_path):  # noqa: F811
    url, http, sessions = studio
    with phone(chromium, as_counter(tmp_path / "counter.y4m")) as one:
        start(one, url, WATCHED, BUSY)
        page = one.page
        http.post("/record/start", json={}).raise_for_status()
        expect(page.locator("#recording")).to_be_visible()
        page.evaluate("seen.length = 0")
        until(page, "seen.length >= 40")
        shown = {time_ns: np.array(bits, float) for time_ns, bits in page.evaluate("seen")}
        page.reload()  # during the take
        page.evaluate("document.querySelector('#mirrored').checked = true")
        page.click("#start")
        one.sends(5)
        until(page, "document.querySelector('#video-kept').checkVisibility()")
        http.post("/record/stop").raise_for_status()
        until(page, "!document.querySelector('#video-kept').checkVisibility()")
        assert one.complaints == []
    videos = videos_of(sessions)
    assert len({video.boot_id for video in videos}) == 2  # one of each start
    first = next(video for video in videos if set(video.times_ns.tolist()) & set(shown))
    numbers = numbers_in(first)
    both = [(number, shown[time_ns]) for time_ns, number in numbers.items() if time_ns in shown]
    assert len(both) >= 15
    assert all(number == number_in(bits) for number, bits in both)
    (second,) = {video.boot_id: video for video in videos if video.boot_id != first.boot_id}.values()
    turned = [*numbers_in(second, mirrored=True).values()]  # its picture was said to be mirrored: turned back
    steps = np.diff(turned) % (1 << BITS)
    assert len(turned) >= 2 and (steps >= 1).all() and (steps < (1 << BITS) // 2).all()


def test_the_operator_asks_all_phones_for_video(studio, chromium, tmp_path):  # noqa: F811
    """And it stays so on the page, which asks the server."""
    url, http, sessions = studio
    with quiet_page(chromium) as page:
        for ticked in (False, True):
            page.goto(url)
            page.get_by_role("button", name="Other cameras").click()
            expect(page.locator("#phones-video")).to_be_enabled()
            assert page.locator("#phones-video").is_checked() == ticked
            page.locator("#phones-video").check()
            expect(page.locator("#phones-video")).to_be_enabled()
            wait_until(lambda: http.get("/phones/video").json()["keep"], "the server knows it")
    with phone(chromium, as_counter(tmp_path / "counter.y4m")) as one:
        one.start(f"{url}/phone", "stand")
        expect(one.page.locator("#video-kept")).to_contain_text("The studio keeps video")
        one.sends(3)
        http.post("/record/start", json={}).raise_for_status()
        expect(one.page.locator("#video-kept")).to_contain_text("part of video kept")
        http.post("/record/stop").raise_for_status()
        wait_until(lambda: one.page.evaluate("1") and videos_of(sessions), "the video is in the take")


@pytest.mark.parametrize(
    ("what", "script"),
    [
        ("codec", "Object.defineProperty(window, 'VideoEncoder', { value: undefined });"),
        ("full", "navigator.storage.estimate = async () => ({ quota: 1000, usage: 0 });"),
        ("database", "indexedDB.open = () => { throw new Error('private'); };"),
    ],
)
def test_why_no_video_is_recorded_is_told(studio, chromium, tmp_path, what, script):  # noqa: F811
    """On the phone and to the operator; the landmarks go on."""
    url, http, _ = studio
    with phone(chromium, as_counter(tmp_path / "counter.y4m")) as one:
        one.page.add_init_script(script)
        start(one, url)
        http.post("/record/start", json={}).raise_for_status()
        expect(one.page.locator("#video-kept")).to_contain_text("No video is recorded")
        wait_until(lambda: is_told(one.page, http, f"video_{what}"), "the studio knows it")
        one.sends(one.frames() + 3)
        http.post("/record/stop").raise_for_status()


def test_the_video_of_a_phone_with_a_hardware_encoder_is_read(tmp_path):
    """H.264 without a container of its own, as WebCodecs gives it, in the container that the phone writes."""
    encoder = av.CodecContext.create("libx264", "w")
    encoder.width, encoder.height, encoder.pix_fmt = 140, 160, "yuv420p"
    encoder.options = {"bf": "0", "tune": "zerolatency"}
    frames = [av.VideoFrame.from_ndarray(one, format="rgb24") for one in numbered_pictures(5)]
    data = [b"".join(bytes(packet) for packet in encoder.encode(frame)) for frame in frames]
    times_us = [0, 33_000, 70_000, 101_000, 140_000]
    file = tmp_path / "phone.ivf"
    head = struct.pack("<4sHH4sHHIIII", b"DKIF", 0, 32, b"H264", 140, 160, 1_000_000, 1, 0, 0)
    records = (struct.pack("<IQ", len(one), at) + one for one, at in zip(data, times_us, strict=True))
    file.write_bytes(head + b"".join(records))
    video = VideoFile.open(file)
    assert video.times_ns().tolist() == [time_ns for time_ns, _ in video.frames()]
    shown = [
        frame.to_ndarray(format="gray")[20, 10 : 20 * BITS : 20].astype(float) for _, frame in video.frames()
    ]
    assert [number_in(row) for row in shown] == list(range(5))
    assert video.times_ns().tolist() == [1000 * at for at in times_us]

"""Chromium as a phone: a real video is its camera."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import av
from playwright.sync_api import Browser, Page

from tests.take.video_takes import BITS, HEIGHT, WIDTH, numbered_pictures
from tests.web.browser import CHROMIUM, FLAGS, WAIT_MS, until

SIZE = (360, 640)
_IN_WORKER = ("gl_context", "landmark_projection", "inference_feedback", "XNNPACK", "Graph successfully")
"""Of what the library for poses writes to the console while all is well."""


def as_camera(video: Path, out: Path) -> Path:
    """Write a video as the pictures of a camera, 360 x 640 at 30 Hz, and return `out`."""
    with av.open(str(video)) as source, out.open("wb") as file:
        for number, frame in enumerate(source.decode(video=0)):
            if number % 2 == 0:  # the videos have 60 Hz
                frame.reformat(*SIZE, interpolation="AREA").to_image().save(file, "JPEG", quality=88)
    return out


def as_walk(video: Path, out: Path) -> Path:
    """Write a video of 60 Hz as an endless motion, 360 x 640 at 10 Hz, and return `out`.

    It is six times slower, and goes back again at its end: a loop that jumps is no motion, and a machine without a
    graphics card looks at 1 to 6 pictures a second.
    """
    with av.open(str(video)) as source:
        there = [frame.reformat(*SIZE, "yuv420p") for frame in source.decode(video=0)]
    with out.open("wb") as file:
        file.write(b"YUV4MPEG2 W%d H%d F10:1 Ip A1:1 C420\n" % SIZE)
        for frame in there + there[-2:0:-1]:
            file.write(b"FRAME\n" + frame.to_ndarray().tobytes())
    return out


def as_counter(out: Path, *, rate_hz: int = 10) -> Path:
    """Write small pictures with their numbers as those of a camera, and return `out`: they cost a page much less than
    Chromium's test picture."""
    with out.open("wb") as file:
        file.write(b"YUV4MPEG2 W%d H%d F%d:1 Ip A1:1 C420\n" % (WIDTH, HEIGHT, rate_hz))
        for picture in numbered_pictures(1 << BITS):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(format="yuv420p")
            file.write(b"FRAME\n" + frame.to_ndarray().tobytes())
    return out


class Phone:
    """A page in a browser of its own, its requests and its complaints."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.requests: list[str] = []
        self.complaints: list[str] = []
        page.context.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda socket: self.requests.append(socket.url))
        page.on("pageerror", lambda error: self.complaints.append(f"{error} {error.stack}"))
        page.on("console", self._heard)

    def _heard(self, message: object) -> None:
        text = message.text  # type: ignore[attr-defined]
        noisy = any(one in text for one in _IN_WORKER) or "GL Driver Message" in text
        if message.type in ("error", "warning") and not noisy:  # type: ignore[attr-defined]
            self.complaints.append(text)

    def open(self, url: str, name: str = "") -> None:
        """Open the page and type the camera's name."""
        self.page.goto(url)
        if name:
            self.page.fill("#name", name)

    def start(self, url: str, name: str = "") -> None:
        """Open the page and press the button."""
        self.open(url, name)
        self.page.click("#start")

    def frames(self) -> int:
        """How many frames were made so far."""
        return int(self.page.evaluate("document.body.dataset.frames"))

    def sends(self, frames: int) -> None:
        """Wait until so many frames were made."""
        until(self.page, f"Number(document.body.dataset.frames) >= {frames}")


@contextmanager
def phone(chromium: Browser, video: Path | None = None, *flags: str) -> Iterator[Phone]:
    """A phone with a video as its camera, or none but Chromium's test picture."""
    camera = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"]
    camera += [f"--use-file-for-fake-video-capture={video}"] if video else []
    browser = chromium.browser_type.launch(executable_path=str(CHROMIUM), args=[*FLAGS, *camera, *flags])
    context = browser.new_context(
        viewport={"width": 390, "height": 844}, has_touch=True, ignore_https_errors=True
    )
    context.set_default_timeout(WAIT_MS)
    context.grant_permissions(["accelerometer", "gyroscope"])  # without a window, nobody is asked
    try:
        yield Phone(context.new_page())
    finally:
        browser.close()

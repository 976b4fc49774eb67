"""The preview of a camera client: the image and its skeleton, in the terminal or as a page."""

import asyncio
import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from studio.camera.sources.tracked import TrackedSource
from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import system_says
from studio.engine.model.cameras.depth import DepthCamera, shade
from studio.engine.model.cameras.observation import Observation
from studio.engine.model.joints import CANONICAL, INDEX

_SHADES = " .:-=+*#%@"
_COLUMNS, _ROWS = 72, 26
_BONES = [
    (INDEX[a], INDEX[b])
    for a, b in (
        ("hips", "spine"), ("spine", "chest"), ("chest", "neck"), ("neck", "head"),
        *((f"{s}_{a}", f"{s}_{b}") for s in ("left", "right") for a, b in
          (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand"), ("hip", "knee"), ("knee", "ankle"),
           ("ankle", "toe"))),
    )
]  # fmt: skip
_REQUEST_BYTES = 8192

_PAGE = """<!doctype html><meta charset="utf-8"><title>Camera</title>
<style>body{font:15px system-ui;margin:1.5rem;background:#16181c;color:#e6e8eb}img{width:min(100%,960px);
image-rendering:pixelated;background:#000}</style><h1 id="name"></h1><p id="status" role="status"></p>
<img id="image" alt="What the camera sees, with the skeleton">
<script>
async function tick(){try{const s=await (await fetch('status.json')).json();
document.getElementById('name').textContent=s.name;document.getElementById('status').textContent=s.text;
document.getElementById('image').src='image.png?'+Date.now()}catch(e){
document.getElementById('status').textContent='the camera client does not answer'}setTimeout(tick,500)}
tick()</script>"""


def text_picture(depth_mm: NDArray[np.uint16], camera: DepthCamera, *bodies: NDArray[np.float64]) -> str:
    """Return a depth image as lines of text, with the joints as O.

    Args:
        depth_mm: shape (height, width).
        camera: of the image.
        bodies: canonical joints of each in the camera frame [m], shape (21, 3); NaN = unseen.
    """
    rows = np.linspace(0, depth_mm.shape[0] - 1, _ROWS).round().astype(int)
    columns = np.linspace(0, depth_mm.shape[1] - 1, _COLUMNS).round().astype(int)
    grey = shade(depth_mm)[np.ix_(rows, columns)]
    letters = np.array(list(_SHADES))[grey.astype(int) * (len(_SHADES) - 1) // 235]
    places = [place for positions in bodies for place in _pixels(camera, positions).values()]
    for column, row in places:
        at = (round(row * (_ROWS - 1) / camera.height), round(column * (_COLUMNS - 1) / camera.width))
        if 0 <= at[0] < _ROWS and 0 <= at[1] < _COLUMNS:
            letters[at] = "O"
    return "\n".join("".join(line) for line in letters)


def png_picture(depth_mm: NDArray[np.uint16], camera: DepthCamera, *bodies: NDArray[np.float64]) -> bytes:
    """Return a depth image with the skeletons drawn into it, as PNG; arguments as for `text_picture`."""
    image = Image.fromarray(shade(depth_mm)).convert("RGB")
    draw = ImageDraw.Draw(image)
    for positions in bodies:
        pixels = _pixels(camera, positions)
        for a, b in _BONES:
            if a in pixels and b in pixels:
                draw.line([pixels[a], pixels[b]], fill=(90, 200, 120), width=2)
    file = io.BytesIO()
    image.save(file, "PNG", compress_level=1)
    return file.getvalue()


def _pixels(camera: DepthCamera, positions: NDArray[np.float64]) -> dict[int, tuple[float, float]]:
    seen = [j for j in range(len(CANONICAL)) if np.isfinite(positions[j]).all() and positions[j, 2] > 0.1]
    return {
        j: (float(c), float(r)) for j, (c, r) in zip(seen, camera.pixels_of(positions[seen]), strict=True)
    }


def _bodies(seen: Observation) -> list[NDArray[np.float64]]:
    return [one.positions for one in seen.each()]


def health(source: TrackedSource) -> str:
    """Return the camera's health in one line."""
    if source.problem:
        return source.problem
    passed = f", {source.passed_over} images passed over" if source.passed_over else ""
    return f"{source.device}: {source.measured_rate:.1f} frames per second, {source.status}{passed}"


class PreviewPage:
    """A small page on this machine with the newest image and the camera's health.

    Args:
        source: of the images.
        port: on the loopback interface; 0 = a free one, see `port` after `start`.
    """

    def __init__(self, source: TrackedSource, port: int) -> None:
        self._source = source
        self.port = port
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        """Start to listen.

        Raises:
            SettingsError: the port is taken.
        """
        try:
            self._server = await asyncio.start_server(
                self._serve, "127.0.0.1", self.port, limit=_REQUEST_BYTES
            )
        except OSError as error:
            raise SettingsError(
                "camera.preview_port",
                "--preview-port {port}: {error}; choose another port",
                port=self.port,
                error=system_says(error),
            ) from error
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            request = await asyncio.wait_for(reader.readline(), 5.0)
            path = [*request.split(), b"", b""][1].partition(b"?")[0]
            status, kind, body = await asyncio.to_thread(self._answer, path.decode("latin-1"))
            head = f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n"
            writer.write(f"{head}Cache-Control: no-store\r\nConnection: close\r\n\r\n".encode() + body)
            await writer.drain()
        except (OSError, ValueError, TimeoutError):
            return  # the browser has left, or this was no request
        finally:
            writer.close()

    def _answer(self, path: str) -> tuple[str, str, bytes]:
        latest = self._source.latest
        if path == "/":
            return "200 OK", "text/html; charset=utf-8", _PAGE.encode()
        if path == "/status.json":
            value: dict[str, Any] = {"name": self._source.name, "text": health(self._source)}
            return "200 OK", "application/json", json.dumps(value).encode()
        if path == "/image.png" and latest is not None:
            return (
                "200 OK",
                "image/png",
                png_picture(latest[0], self._source.depth.camera, *_bodies(latest[1])),
            )
        return "404 Not Found", "text/plain", b"not here"


async def show_in_terminal(
    source: TrackedSource, write: Any, *, picture: bool, period_s: float = 0.5
) -> None:
    """Write the camera's health repeatedly, below a text picture if `picture`; never returns.

    Args:
        source: of the images.
        write: takes text.
        picture: draw the newest image above.
        period_s: time between two outputs.
    """
    drawn = False
    while True:
        latest = source.latest
        if picture and latest is not None:
            up = f"\x1b[{_ROWS}A\r" if drawn else ""
            write(up + text_picture(latest[0], source.depth.camera, *_bodies(latest[1])) + "\n")
            drawn = True
        write(f"\r\x1b[K{health(source)}")
        await asyncio.sleep(period_s)

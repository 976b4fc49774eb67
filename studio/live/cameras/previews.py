"""Small depth images from camera clients: the newest as a picture, the last ones for the floor."""

import io
import threading
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.engine.base.errors import FormatError
from studio.engine.model.cameras.depth import DepthCamera, shade
from studio.live.cameras.links import CameraLink, Links
from studio.live.cameras.newest_depth import ArrivedDepth, NewestDepth
from studio.take.raw.records import depth_camera
from studio.wire import Intrinsics, Preview, preview_array

KEPT = 400
"""Previews kept of each camera: 20 s at 20 Hz, some 3 kB each."""

MAX_CAMERAS = 64
FLOOR_IMAGES = 12
"""Number of a camera's previews in which its floor is searched."""

FloorViews = dict[str, tuple[DepthCamera, list[NDArray[np.uint16]]]]
"""Small images by camera, with their intrinsics."""


class Previews:
    """The last previews of every camera, and in `depth` the newest images; methods may be called from any thread."""

    def __init__(self, links: Links, clock_ns: Callable[[], int]) -> None:
        self._links = links
        self._clock_ns = clock_ns
        self.depth = NewestDepth()
        self._lock = threading.Lock()
        self._last: dict[str, deque[tuple[int, Preview, Intrinsics]]] = {}
        self._counts: dict[str, int] = {}

    def take(self, link: CameraLink, preview: Preview) -> None:
        """Add a preview.

        Raises:
            FormatError: it is damaged, or does not fit the intrinsics of the camera's hello.
            CameraRefused: see `CameraLink`.
        """
        now_ns = self._clock_ns()
        self._links.check(link, now_ns)
        whole = link.hello.intrinsics
        if whole is None:
            raise FormatError(
                "camera.preview_no_intrinsics",
                "a camera that sends previews must tell its intrinsics in hello",
            )
        if (preview.width, preview.height) != tuple(
            -(-n // preview.step) for n in (whole.width, whole.height)
        ):
            raise FormatError(
                "camera.preview_size",
                "a preview of {width} x {height} pixels is not every {step}th of {own_width} x {own_height}",
                width=preview.width,
                height=preview.height,
                step=preview.step,
                own_width=whole.width,
                own_height=whole.height,
            )
        depth_mm = preview_array(preview)
        self.depth.put(link.name, ArrivedDepth(_camera(whole, preview), depth_mm, now_ns, whole=False))
        with self._lock:
            if link.name not in self._last and len(self._last) >= MAX_CAMERAS:
                del self._last[next(iter(self._last))]
            self._last.setdefault(link.name, deque(maxlen=KEPT)).append((now_ns, preview, whole))
            self._counts[link.name] = self._counts.get(link.name, 0) + 1
            if len(self._counts) > MAX_CAMERAS:
                self._counts = {name: self._counts[name] for name in self._last}

    def count(self, name: str) -> int:
        """Number of previews received from a camera."""
        with self._lock:
            return self._counts.get(name, 0)

    def newest(self, name: str) -> tuple[NDArray[np.uint8], DepthCamera] | None:
        """Return a camera's newest preview as grey levels, near = bright, shape (height, width), with its intrinsics;
        None before the first.
        """
        with self._lock:
            last = self._last.get(name)
            newest = last[-1] if last else None
        if newest is None:
            return None
        _, preview, whole = newest
        return shade(preview_array(preview)), _camera(whole, preview)

    def png(self, name: str) -> bytes | None:
        """Return a camera's newest preview as a grey PNG, near = bright; None before the first."""
        newest = self.newest(name)
        if newest is None:
            return None
        file = io.BytesIO()
        Image.fromarray(newest[0]).save(file, "PNG")
        return file.getvalue()

    def floor_views(self, since_ns: int) -> FloorViews:
        """Return some of the previews received since a time on the server's clock, by camera."""
        with self._lock:
            last = {name: [one for one in kept if one[0] >= since_ns] for name, kept in self._last.items()}
        out: FloorViews = {}
        for name, some in last.items():
            if some:
                _, newest, whole = some[-1]
                alike = [p for _, p, w in some if w == whole and p.step == newest.step]
                chosen = alike[:: -(-len(alike) // FLOOR_IMAGES)]
                out[name] = _camera(whole, newest), [preview_array(preview) for preview in chosen]
        return out


def _camera(whole: Intrinsics, preview: Preview) -> DepthCamera:
    """Return the intrinsics of a preview."""
    step, camera = preview.step, depth_camera(whole)
    return DepthCamera(
        camera.fx / step, camera.fy / step, camera.cx / step, camera.cy / step,
        preview.width, preview.height, camera.distortion,
    )  # fmt: skip

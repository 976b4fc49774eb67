"""`studio camera`: runs one source, linked to the server, until it is stopped."""

import asyncio
import contextlib
import logging
import os
import re
import signal
import sys
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from studio.camera.client.link import Link, link_url
from studio.camera.client.spool import MAX_BYTES, Spool
from studio.camera.client.video import VideoRecorder
from studio.camera.client.video_spool import VideoSpool
from studio.camera.sources.config import SourceConfig
from studio.camera.sources.depth_source import DepthSource
from studio.camera.sources.posed import PosedSource
from studio.camera.sources.registry import open_source
from studio.camera.sources.source import Camera, Source
from studio.camera.sources.tracked import TrackedSource
from studio.engine.base.errors import SettingsError
from studio.worker.parent import end_with_parent

log = logging.getLogger(__name__)


def default_spool(server: str, name: str) -> Path:
    """Return the folder for a camera's spool: one for each studio and name, in the user's state folder."""
    state = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    place = re.sub(r"[^A-Za-z0-9.-]+", "_", urlsplit(link_url(server)).netloc)
    return Path(state) / "capture-studio" / "spool" / place / name


def run_camera(
    source: str | SourceConfig | Source | DepthSource,
    server: str = "http://127.0.0.1:8000",
    name: str | None = None,
    token: str = "",
    spool: str | Path | None = None,
    spool_bytes: int = MAX_BYTES,
    parent: int | None = None,
    *,
    record_depth: bool = False,
    preview: bool = False,
    preview_port: int | None = None,
    drop_unknown: bool = False,
    until_let_go: bool = False,
    certificate: Path | None = None,
    keep_video: bool = False,
) -> int:
    """Send a source's frames to a server until Ctrl-C, SIGTERM or the source's end; return the exit code 0.

    A thread other than the main one receives no signal; it ends with the source, or with `parent`.

    Args:
        source: a text `<kind>[:<argument>]`, see `SOURCES`; a configuration; or a user's own camera.
        server: its address, such as http://127.0.0.1:8000.
        name: the camera's name; the source's own where None.
        token: the studio's token for cameras, if it asks for one.
        spool: folder in which frames of recordings are kept until they are on the server's disk; by default
            `default_spool`.
        spool_bytes: its largest size.
        parent: process number of the program that started this one; the client ends with it.
        record_depth: send the depth images too during a recording.
        preview: draw the camera's image as text in the terminal.
        preview_port: show it as a page on this port of this machine; 0 = a free one.
        drop_unknown: delete kept frames of takes that the server lacks.
        until_let_go: end once the server no longer accepts the token, instead of trying again.
        certificate: PEM file of the server's own certificate, if the system does not trust it.
        keep_video: record the video of an ordinary camera during takes; the server fetches it afterwards.

    Raises:
        StudioError: a source, server or name that cannot be used, or a server that refuses the camera.
    """
    end = _OrderlyEnd()
    if parent is not None:
        end_with_parent(parent, end)
    opened = open_source(source, keep_depth=record_depth)
    if (record_depth or preview or preview_port is not None) and not isinstance(opened, TrackedSource):
        given = source.name if isinstance(source, Camera) else source
        raise SettingsError(
            "source.no_depth",
            "source {source!r} gives no depth: there is nothing to preview or to record of it",
            source=given,
        )
    if keep_video and not isinstance(opened, PosedSource):
        raise SettingsError(
            "source.no_video",
            "source {source!r} has no video: --keep-video is for webcam and video:PATH",
            source=source.name if isinstance(source, Camera) else source,
        )
    shown = ClientDisplay(preview, preview_port)
    link = Link(opened, server, name=name)  # reports a wrong address or name before a folder is made
    folder = Path(spool) if spool else default_spool(server, link.name)
    with contextlib.suppress(asyncio.CancelledError, KeyboardInterrupt):
        kept = Spool(folder, max_bytes=spool_bytes)
        videos = _recorder(opened, folder / "video") if keep_video else None
        try:
            link = Link(
                opened,
                server,
                name=name,
                token=token,
                spool=kept,
                drop_unknown=drop_unknown,
                until_let_go=until_let_go,
                certificate=certificate,
                video=videos,
            )
            asyncio.run(_run(opened, link, end, shown))
        finally:
            if videos is not None:
                videos.spool.close()
            kept.close()
    return 0


def _recorder(source: Source, folder: Path) -> VideoRecorder | None:
    """Return the video recorder for an ordinary camera."""
    if not isinstance(source, PosedSource):
        return None
    recorder = VideoRecorder(VideoSpool(folder), mirrored=source.mirrored)
    source.on_picture = recorder.picture
    return recorder


async def _run(source: Source, link: Link, end: "_OrderlyEnd", shown: "ClientDisplay") -> None:
    async with shown.of(source):
        await _run_link(link, end)


@dataclass(frozen=True)
class ClientDisplay:
    """Display of a camera with depth: a picture in the terminal, a page on a port."""

    picture: bool
    port: int | None

    @contextlib.asynccontextmanager
    async def of(self, source: Source) -> AsyncIterator[None]:
        """Display a source during the block; health in the terminal, if standard error is one."""
        if not isinstance(source, TrackedSource):
            yield
            return
        from studio.camera.client.preview import PreviewPage, show_in_terminal

        page = None if self.port is None else PreviewPage(source, self.port)
        if page is not None:
            await page.start()
            log.warning("preview: http://127.0.0.1:%d", page.port)
        wanted = self.picture or sys.stderr.isatty()
        terminal = (
            asyncio.create_task(show_in_terminal(source, _to_terminal, picture=self.picture))
            if wanted
            else None
        )
        try:
            yield
        finally:
            if terminal is not None:
                terminal.cancel()
                await asyncio.gather(terminal, return_exceptions=True)
                _to_terminal("\n")
            if page is not None:
                await page.close()


def _to_terminal(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()


class _OrderlyEnd:
    """Cancels the client's task, once there is one; may be called on any thread."""

    def __init__(self) -> None:
        self.cancel: Callable[[], object] = lambda: None

    def __call__(self) -> None:
        with contextlib.suppress(RuntimeError):  # the client has ended meanwhile
            self.cancel()


async def _run_link(link: Link, end: _OrderlyEnd) -> None:
    task = asyncio.current_task()
    assert task is not None
    loop = asyncio.get_running_loop()
    end.cancel = lambda: loop.call_soon_threadsafe(task.cancel)
    heard = threading.current_thread() is threading.main_thread()
    for number in (signal.SIGINT, signal.SIGTERM) if heard else ():
        with contextlib.suppress(NotImplementedError):  # on Windows, Ctrl-C raises KeyboardInterrupt
            loop.add_signal_handler(number, task.cancel)
    await link.run()

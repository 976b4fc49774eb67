"""`studio camera`: one source, linked to the server until it is stopped."""

import asyncio
import contextlib
import os
import re
import signal
from pathlib import Path
from urllib.parse import urlsplit

from studio.camera.link import Link, link_url
from studio.camera.sources import Source, open_source
from studio.camera.spool import MAX_BYTES, Spool

PARENT_CHECK_S = 0.5


def default_spool(server: str, name: str) -> Path:
    """Return the folder for a camera's spool: one for each studio and name, where programs keep their state."""
    state = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    place = re.sub(r"[^A-Za-z0-9.-]+", "_", urlsplit(link_url(server)).netloc)
    return Path(state) / "capture-studio" / "spool" / place / name


def run_camera(
    source: str,
    server: str = "http://127.0.0.1:8000",
    name: str | None = None,
    token: str = "",
    spool: Path | None = None,
    spool_bytes: int = MAX_BYTES,
    parent: int | None = None,
) -> int:
    """Send a source's frames to a server until Ctrl-C, SIGTERM or the source's end; return the exit code 0.

    Args:
        source: `<kind>:<argument>`, see `sources`.
        server: its address, such as http://127.0.0.1:8000.
        name: the camera's name; the source's own where None.
        token: the studio's token for cameras, where it asks for one.
        spool: folder in which frames of recordings are kept until they are on the server's disk; by default
            `default_spool`.
        spool_bytes: how large it may become.
        parent: process number of the program that started this one: end with it, however it ends.

    Raises:
        StudioError: a source, server or name that cannot be used, or a server that refuses the camera.
    """
    opened = open_source(source)
    with contextlib.suppress(asyncio.CancelledError, KeyboardInterrupt):
        asyncio.run(_run(opened, server, name, token, spool, spool_bytes, parent))
    return 0


async def _run(
    source: Source,
    server: str,
    name: str | None,
    token: str,
    folder: Path | None,
    spool_bytes: int,
    parent: int | None,
) -> None:
    Link(source, server, name=name)  # a wrong address or name is told before a folder is made
    spool = Spool(folder or default_spool(server, name or source.name), max_bytes=spool_bytes)
    try:
        await _run_link(Link(source, server, name=name, token=token, spool=spool), parent=parent)
    finally:
        spool.close()


async def _end_with_parent(task: asyncio.Task[None], parent: int) -> None:
    while os.getppid() == parent:
        await asyncio.sleep(PARENT_CHECK_S)
    task.cancel()


async def _run_link(link: Link, *, parent: int | None) -> None:
    task = asyncio.current_task()
    assert task is not None
    watch = None if parent is None else asyncio.create_task(_end_with_parent(task, parent))
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C comes as KeyboardInterrupt
            loop.add_signal_handler(number, task.cancel)
    try:
        await link.run()
    finally:
        if watch is not None:
            watch.cancel()

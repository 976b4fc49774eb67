"""`studio camera`: one source, linked to the server until it is stopped."""

import asyncio
import contextlib
import signal

from studio.camera.link import Link
from studio.camera.sources import Source, open_source


def run_camera(
    source: str, server: str = "http://127.0.0.1:8000", name: str | None = None, token: str = ""
) -> int:
    """Send a source's frames to a server until Ctrl-C, SIGTERM or the source's end; return the exit code 0.

    Args:
        source: `<kind>:<argument>`, see `sources`.
        server: its address, such as http://127.0.0.1:8000.
        name: the camera's name; the source's own where None.
        token: the studio's token for cameras, where it asks for one.

    Raises:
        StudioError: a source, server or name that cannot be used, or a server that refuses the camera.
    """
    opened = open_source(source)
    with contextlib.suppress(asyncio.CancelledError, KeyboardInterrupt):
        asyncio.run(_run(opened, server, name, token))
    return 0


async def _run(source: Source, server: str, name: str | None, token: str) -> None:
    link = Link(source, server, name=name, token=token)
    task = asyncio.current_task()
    assert task is not None
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C comes as KeyboardInterrupt
            loop.add_signal_handler(number, task.cancel)
    await link.run()

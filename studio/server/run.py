"""Runs the server: the live stage, the page, the simulated stage's cameras, and an orderly end."""

import asyncio
import contextlib
import logging
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from types import FrameType
from typing import Any, NoReturn
from urllib.parse import urlsplit

import uvicorn
from starlette.middleware.trustedhost import TrustedHostMiddleware
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.protocol import State

from studio import worker
from studio.api.access import Access
from studio.api.address import in_url, is_any, own_address
from studio.api.app import create_app
from studio.api.cameras.client_process import ClientProcess
from studio.api.cameras.devices import Devices
from studio.api.cameras.local_cameras import LocalCameras
from studio.api.takes.find import Finder
from studio.live import LiveStage
from studio.server.config import Config, read_token
from studio.server.listening import LOOPBACK, for_own_programs, url_of
from studio.server.tls import Tls, chosen_tls, tls_lines
from studio.timecode.chosen import choose_at_first
from studio.web import mount
from studio.wire import MAX_MESSAGE_BYTES

GRACE_S = 3
_BEGUN_S = 10.0
"""Time after which cameras and page have begun when the first page is opened, also on two slow cores [s]."""
_DISCOVER = {"auto": None, "on": True, "off": False}
SWITCH_S = 0.001
"""Time slice of a thread in the interpreter; it is short, so that the engine thread does not delay the link."""


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """uvicorn's protocol, whose `shutdown` would fail for a connection that its client is closing at that moment."""

    def shutdown(self) -> None:
        """Close the connection."""
        if self.handshake_complete and self.conn.state is not State.OPEN:
            self.transport.close()
        else:
            super().shutdown()


class Server(uvicorn.Server):
    """uvicorn without its own signal handlers, which would end the process before a recording is saved."""

    def __init__(self, config: uvicorn.Config, on_ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._on_ready = on_ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to answer, then call `on_ready`."""
        await super().startup(sockets=sockets)
        self._on_ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End in order; connections still open after the grace period are cut."""
        await super().shutdown(sockets=sockets)
        for connection in list(self.server_state.connections):
            connection.transport.abort()
        await asyncio.sleep(0)  # they are closed in the loop's next round

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to `run`."""
        yield


PLAIN_WARNING = (
    "tokens and motion can be read by others on this network, and no phone can be a camera; run `studio certificate` "
    "and start again, or give --tls-cert and --tls-key"
)


def run(
    config: Config,
    listening: socket.socket,
    *,
    sources: dict[str, str] | None = None,
    performers: int = 1,
    running: Mapping[str, ClientProcess] | None = None,
) -> int:
    """Run the studio until Ctrl-C or SIGTERM, then save a recording under way; return the exit code 0.

    Args:
        config: folder of takes (made if missing), and whether others reach the server.
        listening: its socket, which `start.serve` closes.
        sources: of the simulated stage's cameras, which are started; None = no simulated stage.
        performers: how many are on the simulated stage.
        running: cameras of these that run already.

    Raises:
        StudioError: the folder cannot be made, or the certificate or a token cannot be used.
    """
    host, sessions = config.host, config.sessions
    tls = chosen_tls(config, open_to_others=host not in LOOPBACK)
    operator_token = read_token(config.operator_token_file, "operator_token_file")
    camera_token = read_token(config.camera_token_file, "camera_token_file")
    stage = LiveStage(sessions)
    stage.start(prepare=False)
    view = app = None
    try:
        access = Access(
            sessions,
            required=host not in LOOPBACK,
            now_s=time.monotonic,
            operator_token=operator_token,
            camera_token=camera_token,
        )
        app = create_app(
            stage,
            sessions,
            access=access,
            recordings=config.recordings,
            discover=_DISCOVER[config.discover],
            certificate=None if tls is None else tls.certificate,
            on_page=cache(lambda: worker.warm_up(after_s=_BEGUN_S)),
        )
        choose_at_first(sessions, stage.timecode, config.timecode, config.timecode_rate)
        view = mount(app, stage, sessions=sessions, takes=Finder(stage, sessions), jobs=app.state.jobs)
        if host in LOOPBACK:  # refuses a page that maps its own host name to 127.0.0.1
            app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*LOOPBACK, "[::1]"])
        server = make_server(app, tls, on_ready=lambda: _prepare_for_work(stage, now=sources is not None))
        url = url_of(host, listening, encrypted=tls is not None)
        if sources is not None:
            app.state.local_cameras.start_simulated(for_own_programs(url), sources, performers, running)
        sys.setswitchinterval(SWITCH_S)
        with _stopped_by_signals(server, app.state.local_cameras, app.state.devices):
            print(f"Capture Studio is open on {url} (Ctrl-C stops it)", flush=True)
            if access.required:
                _say_how_to_sign_in(access, _url_for_others(url, host), config, tls)
            server.run(sockets=[listening])
    finally:
        worker.cool_down()
        if app is not None:
            app.state.local_cameras.close()
            app.state.devices.close()
            app.state.announced.close()
            app.state.triggers.close()
        stage.close()
        if app is not None:
            app.state.outputs.close()
        if view is not None:
            view.close()
    return 0


def leave(code: int) -> NoReturn:
    """End this process after `run`, whatever its threads still do; its child processes end too.

    The interpreter's normal end frees objects that a thread may still use. A server that was stopped while a thread
    compiled sometimes crashed (signal 11) instead of returning its exit code.
    """
    for child in multiprocessing.active_children():
        child.terminate()
        child.join()
    worker.begin.tidy()
    logging.shutdown()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # its reader has left
            stream.flush()
    os._exit(code)


def _url_for_others(url: str, host: str) -> str:
    """Return the server's address as other machines reach it: 0.0.0.0 is none that they could open."""
    return url.replace(in_url(host), in_url(own_address() or "127.0.0.1"), 1) if is_any(host) else url


def _say_how_to_sign_in(access: Access, url: str, config: Config, tls: Tls | None) -> None:
    """Print the operator's token and, if no camera was paired yet, a first token for cameras.

    Tokens from files are not printed, because output may end up in a log.
    """
    if config.operator_token_file is None:
        print(f"operators sign in with the token {access.operator_token}", flush=True)
    else:
        print(f"operators sign in with the token in {config.operator_token_file}", flush=True)
    paired = len(access.camera_tokens())
    if config.camera_token_file is not None:
        print(f"cameras: studio camera --source SOURCE --server {url} --token-file FILE", flush=True)
    elif paired:
        print(
            f"{paired} camera tokens are valid; Access on the page makes others and revokes them", flush=True
        )
    else:
        _, token = access.add_camera("made at the first start")
        print(f"cameras: studio camera --source SOURCE --server {url} --token {token}", flush=True)
    print(f"other machines open it on {url}", flush=True)
    if tls is None:
        print(f"warning: {PLAIN_WARNING}", file=sys.stderr, flush=True)
    for line in [] if tls is None else tls_lines(tls, urlsplit(url).hostname or ""):
        print(line, flush=True)


def _prepare_for_work(stage: LiveStage, *, now: bool) -> None:
    """Load modules that were left out for a quick start: those of the stage in a separate thread, `now` or once they
    are needed; those of a solve in a process, with the first work or once a page has been open for a while."""
    stage.prepare(now=now)
    worker.warm_up(after_s=None)


def make_server(
    app: Callable[..., Any], tls: Tls | None = None, *, on_ready: Callable[[], None] = lambda: None
) -> Server:
    """Return the server of an app; its socket is given to `run`, `on_ready` is called once it answers."""
    files: dict[str, Any] = (
        {} if tls is None else {"ssl_certfile": str(tls.certificate), "ssl_keyfile": str(tls.key)}
    )
    return Server(
        uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            lifespan="off",
            ws=WebSocketProtocol,
            ws_max_size=MAX_MESSAGE_BYTES,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=GRACE_S,
            **files,
        ),
        on_ready,
    )


@contextmanager
def _stopped_by_signals(server: Server, *clients: LocalCameras | Devices) -> Iterator[None]:
    """Let the first Ctrl-C or SIGTERM end the server in order, the second at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_number: int, _frame: FrameType | None) -> None:
        server.force_exit = server.should_exit
        server.should_exit = True
        for one in clients:
            one.end()

    old = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)

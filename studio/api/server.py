"""Runs the server: the socket, the live stage, the page, the simulated stage, and an orderly end."""

import logging
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import uvicorn
from starlette.middleware.trustedhost import TrustedHostMiddleware

from studio.api.app import create_app
from studio.api.demo import DemoCameras
from studio.engine.errors import StudioError
from studio.live import LiveStage
from studio.web import mount
from studio.wire import MAX_MESSAGE_BYTES

LOOPBACK = ("127.0.0.1", "localhost", "::1")
GRACE_S = 3
SWITCH_S = 0.001
"""How long a thread may keep the interpreter: short, so that the engine thread does not delay the link."""


class Server(uvicorn.Server):
    """uvicorn without its own signal handlers: it would end the process before a recording is saved."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to `serve`."""
        yield


def open_socket(host: str, port: int) -> socket.socket:
    """Return a socket that is bound to the address.

    Raises:
        StudioError: the port is in use, or the address is not this machine's.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        opened = socket.socket(family, kind, protocol)
    except OSError as error:
        raise StudioError(f"cannot listen on {host}: {error.strerror}; choose another --host") from error
    if sys.platform != "win32":
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        opened.bind(address)
        opened.listen(128)
    except OSError as error:
        opened.close()
        raise StudioError(
            f"cannot listen on {host} port {port}: {error.strerror}; stop what uses it or choose another --port"
        ) from error
    return opened


OPEN_WARNING = (
    "whoever reaches this address can operate the studio and send as a camera: this version has no sign-in; "
    "use a network that you trust"
)


def serve(
    host: str = "127.0.0.1",
    port: int = 8000,
    sessions: Path = Path("sessions"),
    demo: bool = False,
) -> int:
    """Run the studio until Ctrl-C or SIGTERM, then save a recording under way; return the exit code 0.

    Args:
        host: address to listen on; the loopback one keeps other machines out.
        port: 0 takes a free one.
        sessions: folder of the takes, made where missing.
        demo: start two simulated cameras, and calibrate where there is no calibration yet.

    Raises:
        StudioError: the port is in use, or the folder cannot be made.
    """
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    logging.getLogger("websockets").setLevel(logging.WARNING)
    listening = open_socket(host, port)
    try:
        stage = LiveStage(sessions)
        stage.start()
    except BaseException:
        listening.close()
        raise
    cameras = view = None
    try:
        app = create_app(stage, sessions)
        view = mount(app, stage, sessions=sessions)
        if host in LOOPBACK:  # a page that renames its own host to 127.0.0.1 is refused
            app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*LOOPBACK, "[::1]"])
        server = make_server(app)
        url = f"http://{'localhost' if host == '::1' else host}:{listening.getsockname()[1]}"
        if demo:
            cameras = DemoCameras(stage, url.replace("0.0.0.0", "127.0.0.1"))
            cameras.start()
        print(f"Capture Studio is open on {url} (Ctrl-C stops it)", flush=True)
        if host not in LOOPBACK:
            print(f"warning: {OPEN_WARNING}", file=sys.stderr, flush=True)
        sys.setswitchinterval(SWITCH_S)
        with _stopped_by_signals(server, cameras):
            server.run(sockets=[listening])
    finally:
        if cameras is not None:
            cameras.close()
        stage.close()
        if view is not None:
            view.close()
        listening.close()
    return 0


def make_server(app: object) -> Server:
    """Return the server of an app; its socket is given to `run`."""
    return Server(
        uvicorn.Config(
            app,  # type: ignore[arg-type]
            log_level="warning",
            access_log=False,
            lifespan="off",
            ws="websockets-sansio",
            ws_max_size=MAX_MESSAGE_BYTES,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=GRACE_S,
        )
    )


@contextmanager
def _stopped_by_signals(server: Server, cameras: DemoCameras | None) -> Iterator[None]:
    """Have the first Ctrl-C or SIGTERM end the server in order, the second at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_number: int, _frame: FrameType | None) -> None:
        server.force_exit = server.should_exit
        server.should_exit = True
        if cameras is not None:
            cameras.end()

    old = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)

"""Real servers and camera clients as processes that can be killed, and a link between them that can be cut."""

import contextlib
import random
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from studio.take.raw.frames import RawFrame, read_raw
from tests import patient

START_S = 240.0
_random = random.SystemRandom()


def wait_until(happened: Callable[[], Any], what: str, timeout_s: float = START_S) -> Any:
    """Call `happened` until it returns something true, and return that; wait while the server does not answer.

    It is asked less often the longer it lasts, because each answer costs the server some milliseconds.
    """
    begin = time.monotonic()
    while True:
        try:
            if value := happened():
                return value
        except httpx.HTTPError:
            pass
        waited_s = time.monotonic() - begin
        assert waited_s < timeout_s, f"waited {timeout_s:.0f} s in vain until {what}"
        time.sleep(min(0.05 + 0.05 * waited_s, 0.3))


def free_port() -> int:
    """Return a free port. It is below the ports that the system gives to connections, so it stays free."""
    while True:
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", _random.randrange(15_000, 30_000)))
            except OSError:
                continue
            return probe.getsockname()[1]


class ServerProcess:
    """`studio serve` on a folder of sessions, with more `options`, which can be killed and started again."""

    def __init__(self, sessions: Path, *options: str) -> None:
        self.sessions = sessions
        self._options = options
        self.port = free_port()
        self.http = patient.Client(base_url=f"http://127.0.0.1:{self.port}/api/v1", timeout=60.0)
        self._log = sessions.with_suffix(".log")
        self.process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it and wait until it answers."""
        command = [sys.executable, "-m", "studio", "serve", "--port", str(self.port)]
        with self._log.open("a") as log:
            self.process = subprocess.Popen(
                [*command, "--sessions", str(self.sessions), *self._options],
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        wait_until(self._answers, "the server answers")

    def _answers(self) -> bool:
        assert self.process is not None and self.process.poll() is None, self._log.read_text()
        return self.http.get("/status").status_code in (200, 401)

    def operator_token(self) -> str:
        """The operator's token since the last start; only for a server that asks for one."""
        return re.findall(r"operators sign in with the token (\S+)", self._log.read_text())[-1]

    def kill(self) -> int:
        """Kill it without a warning; return when, on the server's clock [ns]."""
        assert self.process is not None
        self.process.kill()
        now = time.monotonic_ns()
        self.process.wait()
        return now

    def close(self) -> None:
        """End it as a user would."""
        self.http.close()
        if self.process is not None and self.process.poll() is None:
            self.process.terminate()
            assert self.process.wait(60) == 0, self._log.read_text()

    def status(self) -> dict[str, Any]:
        return self.http.get("/status").json()

    def record(self, name: str) -> Path:
        """Begin a take; return its folder."""
        answer = self.http.post("/record/start", json={"session": "tests", "take": name})
        assert answer.status_code == 201, answer.text
        return self.sessions / "tests" / name

    def stop(self) -> dict[str, Any]:
        answer = self.http.post("/record/stop")
        assert answer.status_code == 200, answer.text
        return answer.json()

    def live_cameras(self) -> int:
        """How many cameras send frames."""
        return sum(camera["state"] in ("live", "trouble") for camera in self.status()["cameras"].values())

    def kept(self) -> int:
        """How many frames the clients still keep, by their last report; one without any counts as keeping some."""
        cameras = [camera for camera in self.status()["cameras"].values() if camera["connected"]]
        kept = [camera["kept_by_client"] for camera in cameras]
        return sum(1 if count is None else count for count in kept)


@contextmanager
def server_process(sessions: Path, *options: str) -> Iterator[ServerProcess]:
    """A server that is running."""
    sessions.mkdir(parents=True, exist_ok=True)
    server = ServerProcess(sessions, *options)
    try:
        server.start()
        yield server
    finally:
        server.close()


class CameraProcess:
    """`studio camera` with a simulated source, which can be killed and started again."""

    def __init__(self, folder: Path, url: str, index: int, count: int, *, source: str = "simulated") -> None:
        self.name = f"camera_{index}"
        self.spool = folder / f"spool_{index}"
        self._log = folder / f"camera_{index}.log"
        self._command = [sys.executable, "-m", "studio", "camera", "--source", f"{source}:{index}/{count}"]
        self._command += ["--name", self.name, "--server", url, "--spool", str(self.spool)]
        self.process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        with self._log.open("a") as log:
            self.process = subprocess.Popen(self._command, stdout=log, stderr=subprocess.STDOUT)

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        self.process.wait()

    def close(self) -> None:
        if self.process is not None and self.process.poll() is None:
            self.process.terminate()
            assert self.process.wait(60) == 0, self._log.read_text()


@contextmanager
def camera_processes(folder: Path, url: str, count: int) -> Iterator[list[CameraProcess]]:
    """So many camera clients that are running."""
    cameras: list[CameraProcess] = []
    try:
        for index in range(count):
            cameras.append(CameraProcess(folder, url, index, count))
        yield cameras
    finally:
        for camera in cameras:
            camera.close()


class Proxy:
    """Forwards TCP connections to a port until it is cut. Then it forwards nothing, not even a connection's end."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._cut = threading.Event()
        self._sockets: list[socket.socket] = []
        self._lock = threading.Lock()
        self._closed = False
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._accepting = threading.Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def cut(self, *, silently: bool) -> None:
        """Break all connections and refuse new ones. Both ends notice it, or with `silently` neither does."""
        self._cut.set()
        if not silently:
            self._close_all()

    def mend(self) -> None:
        """Let new connections through again; those that were cut are gone."""
        self._close_all()
        self._cut.clear()

    def close(self) -> None:
        self._closed = True
        with contextlib.suppress(OSError):  # some systems cannot shut down a listening socket
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes the thread that accepts
        self._listener.close()
        self._accepting.join(timeout=10)
        self._close_all()

    def _close_all(self) -> None:
        with self._lock:
            for each in self._sockets:
                try:
                    each.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
                each.close()
            self._sockets.clear()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            if self._closed or self._cut.is_set():
                client.close()
                continue
            try:
                server = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                client.close()
                continue
            with self._lock:
                self._sockets += [client, server]
            for pair in ((client, server), (server, client)):
                threading.Thread(target=self._pass, args=pair, daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                if self._cut.is_set():
                    return  # swallowed, as by a cable that was pulled
                target.sendall(data)
            if not self._cut.is_set():
                target.shutdown(socket.SHUT_WR)
        except OSError:
            return


def sequences(raw: Path) -> dict[tuple[str, str], list[int]]:
    """Numbers of the frames on disk, by camera and start of its client, in file order."""
    found: dict[tuple[str, str], list[int]] = {}
    for record in read_raw(raw):
        if isinstance(record, RawFrame):
            found.setdefault((record.camera, record.boot_id), []).append(record.message.sequence)
    return found


def check_nothing_lost(raw: Path) -> int:
    """Assert that no frame is missing between those on disk, and none is there twice; return how many there are."""
    total = 0
    for key, numbers in sequences(raw).items():
        assert len(numbers) == len(set(numbers)), f"{key}: {len(numbers) - len(set(numbers))} frames twice"
        missing = set(range(min(numbers), max(numbers) + 1)) - set(numbers)
        assert not missing, f"{key}: {len(missing)} frames missing, such as {sorted(missing)[:5]}"
        total += len(numbers)
    return total

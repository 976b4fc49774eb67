"""`studio serve` as a process of its own: opening, refusing, ending in order."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI, WebSocket
from websockets.sync.client import connect

from studio.api.stage.events import EVENTS_PATH
from studio.server.listening import open_socket
from studio.server.run import make_server
from studio.take.folder.take import Take
from studio.take.raw.frames import inspect_raw
from studio.worker.begin import COPIES
from tests import patient
from tests.api.camera import Camera, send_frames, wait_until

COMMAND = [sys.executable, "-m", "studio", "serve"]


class Program:
    """A server process on a folder of sessions, and its address."""

    def __init__(self, sessions: Path, **environment: str) -> None:
        self.sessions = sessions
        self.process = subprocess.Popen(
            [*COMMAND, "--port", "0", "--sessions", str(sessions)],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | environment,
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        self.url = next(word for word in line.split() if word.startswith("http://"))

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture(scope="module")
def programs() -> Iterator[list[Program]]:
    """The server processes of this file, the newest one last."""
    started: list[Program] = []
    yield started
    for program in started:
        program.close()


@pytest.fixture
def program(programs: list[Program], tmp_path: Path) -> Program:
    """A server process that runs; a new one where the test before has ended it."""
    if not programs or programs[-1].process.poll() is not None:
        programs.append(Program(tmp_path / "sessions"))
    return programs[-1]


@pytest.fixture
def ending_program(program: Program) -> Iterator[Program]:
    """The same for a test that ends it; it has ended afterwards, also where the test fails."""
    yield program
    program.close()


def test_a_page_that_pretends_to_be_on_this_machine_is_refused(program):
    url = program.url
    assert patient.get(f"{url}/api/v1/status", timeout=60.0).status_code == 200
    answer = patient.get(f"{url}/api/v1/status", headers={"host": "rebound.example"}, timeout=60.0)
    assert answer.status_code == 400


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_end_finishes_the_recording(ending_program, number):
    process, url = ending_program.process, ending_program.url
    http = patient.Client(base_url=f"{url}/api/v1", timeout=60.0)
    with http, Camera(url.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet()
        http.post("/record/start", json={"session": "s", "take": "t"}).raise_for_status()
        send_frames([camera], 10)
        wait_until(lambda: http.get("/status").json()["recording"]["frames"] == 10, "10 frames came")
        process.send_signal(number)
        assert process.wait(60) == 0
    take = Take.open(ending_program.sessions / "s" / "t")
    assert take.meta["recording"] == "done"
    summary = inspect_raw(take.raw_path)
    assert summary.complete and summary.frames == {"camera_0": 10}


@pytest.mark.skipif(not COPIES, reason="this system copies no processes")
def test_a_server_that_ends_leaves_nothing_of_its_processes(tmp_path):
    with tempfile.TemporaryDirectory() as folder:
        program = Program(tmp_path / "sessions", TMPDIR=folder)
        with connect(program.url.replace("http", "ws") + EVENTS_PATH):  # as a page that is open
            wait_until(lambda: [*Path(folder).glob("pymp-*/*")], "the process that is copied is there")
        program.process.terminate()
        assert program.process.wait(60) == 0
        assert [*Path(folder).glob("pymp-*")] == []
        program.close()


def test_what_a_killed_server_recorded_can_be_read(ending_program):
    process, url = ending_program.process, ending_program.url
    http = patient.Client(base_url=f"{url}/api/v1", timeout=60.0)
    with http, Camera(url.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet()
        http.post("/record/start", json={"session": "s", "take": "t"}).raise_for_status()
        send_frames([camera], 10)
        raw = ending_program.sessions / "s" / "t" / "raw.mcap"
        wait_until(lambda: sum(inspect_raw(raw).frames.values()) == 10, "the frames are on the disk")
        process.kill()
        process.wait()
    assert Take.open(raw.parent).meta["recording"] == "recording"
    assert inspect_raw(raw).frames == {"camera_0": 10}


def test_a_port_in_use_is_one_clear_line(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = subprocess.run(
            [*COMMAND, "--port", str(port), "--sessions", str(tmp_path / "sessions")],
            capture_output=True,
            text=True,
            timeout=120,
        )
    assert done.returncode == 1 and done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1
    assert str(port) in done.stderr and "--port" in done.stderr


def test_what_is_still_open_after_the_time_of_grace_is_cut():
    app = FastAPI()

    @app.get("/wait")
    async def wait() -> None:
        await asyncio.sleep(600)

    listening = open_socket("127.0.0.1", 0)
    server = make_server(app)
    thread = threading.Thread(target=server.run, args=([listening],))
    thread.start()
    wait_until(lambda: server.started, "it answers")
    with socket.create_connection(listening.getsockname()) as client, listening:
        client.sendall(b"GET /wait HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        wait_until(lambda: server.server_state.tasks, "the request is worked on")
        (connection,) = server.server_state.connections
        server.should_exit = True
        thread.join()
        assert connection.transport.get_extra_info("socket").fileno() == -1


def test_a_connection_that_is_being_closed_does_not_keep_the_server_from_its_end():
    app = FastAPI()

    @app.websocket("/events")
    async def events(socket: WebSocket) -> None:
        await socket.accept()
        (connection,) = server.server_state.connections
        connection.conn.send_close(1000)  # as it stands between a client's word and its end
        server.should_exit = True
        await asyncio.sleep(600)

    listening = open_socket("127.0.0.1", 0)
    server = make_server(app)
    ended = []
    thread = threading.Thread(target=lambda: ended.append(server.run([listening])))
    thread.start()
    wait_until(lambda: server.started, "it answers")
    host, port = listening.getsockname()
    with connect(f"ws://{host}:{port}/events"), listening:
        thread.join()
    assert ended == [None]


def test_leaving_does_not_take_the_interpreter_down_first():
    """A thread that compiles may crash the interpreter's own end. A function that runs at that end stands for it."""
    code = """
        import atexit, multiprocessing, os, sys, time
        from studio.server.run import leave
        if __name__ == "__main__":
            atexit.register(os.abort)
            child = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,), daemon=True)
            child.start()
            print(child.pid, end="")
            leave(3)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 3, done.stderr
    with pytest.raises(ProcessLookupError):
        os.kill(int(done.stdout), 0)

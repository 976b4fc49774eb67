"""`studio serve` as a process of its own: opening, refusing, ending in order."""

import signal
import socket
import subprocess
import sys

import httpx
import pytest

from studio.take.raw import inspect_raw
from studio.take.take import Take
from tests.api.camera import Camera, send_frames, wait_until

COMMAND = [sys.executable, "-m", "studio", "serve"]


@pytest.fixture
def serving(tmp_path):
    """A server process and its address."""
    process = subprocess.Popen(
        [*COMMAND, "--port", "0", "--sessions", str(tmp_path / "sessions")], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    yield process, next(word for word in line.split() if word.startswith("http://"))
    process.kill()
    process.wait()
    process.stdout.close()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_end_finishes_the_recording(serving, tmp_path, number):
    process, url = serving
    http = httpx.Client(base_url=f"{url}/api/v1", timeout=60.0)
    with http, Camera(url.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet()
        http.post("/record/start", json={"session": "s", "take": "t"}).raise_for_status()
        send_frames([camera], 10)
        wait_until(lambda: http.get("/status").json()["recording"]["frames"] == 10, "10 frames came")
        process.send_signal(number)
        assert process.wait(60) == 0
    take = Take.open(tmp_path / "sessions" / "s" / "t")
    assert take.meta["recording"] == "done"
    summary = inspect_raw(take.raw_path)
    assert summary.complete and summary.frames == {"camera_0": 10}


def test_what_a_killed_server_recorded_can_be_read(serving, tmp_path):
    process, url = serving
    http = httpx.Client(base_url=f"{url}/api/v1", timeout=60.0)
    with http, Camera(url.replace("http", "ws") + "/api/v1/link", 0) as camera:
        camera.greet()
        http.post("/record/start", json={"session": "s", "take": "t"}).raise_for_status()
        send_frames([camera], 10)
        raw = tmp_path / "sessions" / "s" / "t" / "raw.mcap"
        wait_until(lambda: sum(inspect_raw(raw).frames.values()) == 10, "the frames are on the disk")
        process.kill()
        process.wait()
    assert Take.open(raw.parent).meta["recording"] == "recording"
    assert inspect_raw(raw).frames == {"camera_0": 10}


def test_a_page_that_pretends_to_be_on_this_machine_is_refused(serving):
    _, url = serving
    assert httpx.get(f"{url}/api/v1/status", timeout=60.0).status_code == 200
    answer = httpx.get(f"{url}/api/v1/status", headers={"host": "rebound.example"}, timeout=60.0)
    assert answer.status_code == 400


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

"""Eight cameras of 25 joints at 30 Hz with the solver running: no frame lost, and taking them in is cheap."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from studio.api.app import create_app
from studio.live import LiveStage
from studio.live.engine import Engine
from studio.live.inbox import Arrived
from studio.server.listening import open_socket
from studio.server.run import SWITCH_S, make_server
from tests.acceptance.processes import check_nothing_lost, wait_until
from tests.live.performer import save_stage_calibration

CAMERAS = 8
MOST_OF_A_CORE = 0.25


def thread_cpu_s(name: str) -> float:
    """Processor time of this process's threads of a name [s]."""
    total = 0.0
    for thread in threading.enumerate():
        if thread.name == name:
            stat = Path(f"/proc/self/task/{thread.native_id}/stat").read_text().rsplit(")", 1)[1].split()
            total += (int(stat[11]) + int(stat[12])) / 100.0
    return total


def count_handling(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Have the engine thread count the processor time that camera frames cost it, without the solver [s]."""
    spent = [0.0]
    handle = Engine._handle_one

    def counted(self: Engine, item: object, waiting: object) -> None:
        if not isinstance(item, Arrived):
            return handle(self, item, waiting)
        begin = time.thread_time()
        handle(self, item, waiting)
        spent[0] += time.thread_time() - begin

    monkeypatch.setattr(Engine, "_handle_one", counted)
    return spent


def run_load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    sessions = tmp_path / "sessions"
    save_stage_calibration(sessions, [f"camera_{index}" for index in range(CAMERAS)])
    handling = count_handling(monkeypatch)
    listening = open_socket("127.0.0.1", 0)
    url = f"http://127.0.0.1:{listening.getsockname()[1]}"
    stage = LiveStage(sessions)
    stage.start()
    server = make_server(create_app(stage, sessions))
    loop = threading.Thread(target=server.run, args=([listening],), name="event loop")
    loop.start()
    switch_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    command = [sys.executable, "-m", "tests.acceptance.load_cameras", url, str(tmp_path), str(CAMERAS)]
    clients = subprocess.Popen(command, cwd=Path(__file__).parents[2])
    try:
        wait_until(lambda: _sending(stage) == CAMERAS, "all cameras send")
        wait_until(lambda: stage.status().pipeline.rate_hz > 1, "the solver runs")
        stage.start_recording("tests", "load")
        before = (thread_cpu_s("event loop"), handling[0])
        time.sleep(seconds)
        spent = (
            thread_cpu_s("event loop"),
            handling[0],
            thread_cpu_s("recorder") + thread_cpu_s("recorder disk"),
        )
        status = stage.status()
        dropped = {name: camera.dropped_by_client for name, camera in status.cameras.items()}
        summary = stage.stop_recording()
        wait_until(lambda: _kept(stage) == 0, "nothing is owed")
    finally:
        clients.terminate()
        assert clients.wait(60) == 0
        server.should_exit = True
        loop.join()
        stage.close()
        listening.close()
        sys.setswitchinterval(switch_s)
    count = check_nothing_lost(sessions / "tests" / "load" / "raw.mcap")
    nominal_s = count / (CAMERAS * 30)  # as if the frames had come at their rate: a busy machine sends fewer
    shares = [(after - first) / nominal_s for first, after in zip((*before, 0.0), spent, strict=True)]
    print(
        f"{count} frames in {seconds:.0f} s; shares of a core: link {shares[0]:.3f}, engine {shares[1]:.3f}, "
        f"recorder {shares[2]:.3f}; solver {status.pipeline.rate_hz} Hz, left out "
        f"{status.pipeline.left_out}"
    )
    assert summary.problem == "" and summary.poses > 0
    assert not any(dropped.values()), dropped  # the link kept up: its clients had to leave nothing out
    assert sum(shares) < MOST_OF_A_CORE


def _sending(stage: LiveStage) -> int:
    return sum(camera.fps > 0 for camera in stage.status().cameras.values())


def _kept(stage: LiveStage) -> int:
    return sum(camera.kept_by_client or 0 for camera in stage.status().cameras.values())


@pytest.mark.timeout(900)
def test_load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_load(tmp_path, monkeypatch, 5.0)


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_load_for_10_minutes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_load(tmp_path, monkeypatch, 600.0)

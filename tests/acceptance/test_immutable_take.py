"""kill -9 while recording, start again, Stop, then a recording played as cameras of its names: the take stays.

`tests/live/test_immutable.py` and `tests/live/test_own_frames.py` do the same within one process.
"""

import time
from pathlib import Path

import pytest

from studio.take.folder.lock import is_held
from studio.take.library.sessions import take_info
from studio.take.raw.frames import RawFrame, inspect_raw, read_raw
from tests.acceptance.processes import (
    ServerProcess,
    check_nothing_lost,
    sequences,
    server_process,
    wait_until,
)

CAMERAS = 2


def play(server: ServerProcess, **what: object) -> None:
    """Have the server start clients on its own machine, and wait until they send."""
    answer = server.http.post("/local-cameras", json=what)
    assert answer.status_code == 201, answer.text
    wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras send")


def taken_s(raw: Path) -> float:
    """From a camera's first frame to its last, as its clock tells [s]; the longest of all."""
    times: dict[str, list[int]] = {}
    for record in read_raw(raw):
        if isinstance(record, RawFrame):
            times.setdefault(record.boot_id, []).append(record.message.device_time_ns)
    return max(max(each) - min(each) for each in times.values()) * 1e-9


def settled(server: ServerProcess, raw: Path) -> bool:
    """Whether the clients owe nothing, and nobody writes the take."""
    return server.kept() == 0 and not is_held(raw) and inspect_raw(raw).complete


@pytest.mark.long
@pytest.mark.timeout(900)
def test_a_take_that_was_stopped_after_a_kill_is_not_changed_by_cameras_of_its_names(tmp_path: Path) -> None:
    with server_process(tmp_path / "sessions") as server:
        play(server, simulated=True)
        server.record("played")
        time.sleep(2.0)
        server.stop()
        path = server.record("killed")
        raw = path / "raw.mcap"
        time.sleep(1.5)
        server.kill()
        before = sequences(raw)
        server.start()
        assert "no camera has brought frames of it" in server.status()["recording"]["notice"]
        seconds = server.stop()["seconds"]
        play(server, recording="takes/tests/played")
        wait_until(lambda: settled(server, raw), "the first clients' frames are there")
        after, content, length_s = sequences(raw), raw.read_bytes(), take_info(path).length_s
        assert before.keys() == after.keys() and all(set(before[key]) <= set(after[key]) for key in before)
        span_s = taken_s(raw)
        assert length_s is not None and length_s <= min(seconds, span_s + 1.0) and span_s <= seconds
        assert abs(inspect_raw(raw).duration_s - length_s) < 1e-6
        server.record("next")
        time.sleep(1.0)
        server.stop()
        wait_until(lambda: settled(server, server.sessions / "tests" / "next" / "raw.mcap"), "all is there")
        assert raw.read_bytes() == content and take_info(path).length_s == length_s
    check_nothing_lost(raw)
    late = sum(record.late for record in read_raw(raw) if isinstance(record, RawFrame))
    print(f"{late} frames that the first clients had kept came late; {length_s:.2f} s before and after")

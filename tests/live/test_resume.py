"""A server that finds the mark of a recording: it continues the take, or ends it, and says if it cannot."""

import time
from pathlib import Path

import pytest
from msgspec.structs import replace

from studio.live import LiveStage
from studio.take.folder.marker import RECORDING, STOPPING, RecordingMarker, machine, read_marker, write_marker
from studio.take.folder.take import Take
from studio.take.raw.frames import RawEvent, inspect_raw, read_raw
from studio.take.raw.live_log import RestartEvent, StartEvent, StoppedEvent
from tests.api.camera import wait_until
from tests.take.test_raw_append import crashed_live_take

SECOND = 1_000_000_000


def started(sessions: Path) -> LiveStage:
    stage = LiveStage(sessions)
    stage.start()
    return stage


def test_a_take_goes_on_and_ends_when_the_operator_ends_it(tmp_path: Path) -> None:
    take = crashed_live_take(tmp_path)
    stage = started(tmp_path)
    try:
        wait_until(lambda: stage.status().recording.active, "it goes on")
        recording = stage.status().recording
        assert recording.take == "take_001" and "started again" in recording.notice
        marker = read_marker(tmp_path)
        assert marker is not None and len(marker.restarts) == 1
        summary = stage.stop_recording()
        assert summary.frames == 50 and summary.poses == 25
    finally:
        stage.close()
    assert read_marker(tmp_path) is None and Take.open(take.path).meta["recording"] == "done"
    assert inspect_raw(take.raw_path).complete and take.solve_names() == ["live"]
    kinds = [type(r.event) for r in read_raw(take.raw_path) if isinstance(r, RawEvent)]
    assert kinds[-3:] == [RestartEvent, StartEvent, StoppedEvent]
    assert len(list(take.path.glob("raw.torn.*"))) == 1


def test_a_take_whose_end_was_asked_for_is_ended(tmp_path: Path) -> None:
    take = crashed_live_take(tmp_path)
    marker = read_marker(tmp_path)
    assert marker is not None
    write_marker(tmp_path, replace(marker, state=STOPPING))
    stage = started(tmp_path)
    try:
        assert not stage.status().recording.active and read_marker(tmp_path) is None
    finally:
        stage.close()
    assert inspect_raw(take.raw_path).complete and take.solve_names() == ["live"]
    assert Take.open(take.path).meta["recording"] == "done"


def test_a_take_that_is_gone_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    write_marker(tmp_path, RecordingMarker("day", "gone", "0a1b", RECORDING, 1, 2, 3, machine()))
    stage = started(tmp_path)
    try:
        wait_until(lambda: "day/gone" in stage.status().recording.problem, "it is told")
        assert not stage.status().recording.active and read_marker(tmp_path) is None
    finally:
        stage.close()


def test_the_servers_clock_goes_on_when_the_machine_was_started_anew(tmp_path: Path) -> None:
    crashed_live_take(tmp_path)
    server_ns = time.monotonic_ns() + 10**6 * SECOND
    marker = RecordingMarker(
        "day", "take_001", "0a1b", RECORDING, server_ns, server_ns, time.time_ns(), "another start"
    )
    write_marker(tmp_path, marker)
    stage = LiveStage(tmp_path)
    assert 0 <= stage.clock_ns() - server_ns < 60 * SECOND
    write_marker(tmp_path, replace(marker, machine=machine()))
    assert abs(LiveStage(tmp_path).clock_ns() - time.monotonic_ns()) < SECOND

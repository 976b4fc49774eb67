"""Until a process is ready for a pipeline, frames are recorded and nothing else waits."""

import threading
import time

import numpy as np
import pytest

from studio import wire
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.lens import usual_lens
from studio.engine.model.frames import StepResult
from studio.live import LiveStage, warmup
from studio.take.folder.take import Take
from studio.take.raw.frames import RawEvent, inspect_raw, read_raw
from studio.take.raw.live_log import StartEvent
from studio.take.raw.records import camera_frame
from tests.api.camera import wait_until
from tests.live.performer import frame, hello, save_stage_calibration


@pytest.fixture
def readiness(monkeypatch) -> threading.Event:
    """The process is not ready before this is set."""
    ready = threading.Event()
    for name in ("_ready", "_ready_for_pictures"):
        monkeypatch.setattr(warmup, name, ready)
    monkeypatch.setattr(warmup, "_prepare", lambda *what: ready.wait(60))
    return ready


def test_frames_are_recorded_before_the_process_is_ready(tmp_path, readiness):
    save_stage_calibration(tmp_path, ["camera_0"])
    stage = LiveStage(tmp_path)
    stage.start()
    try:
        shown: list[StepResult] = []
        solved: list[StepResult] = []
        stage.subscribe(shown.append, raw=True)
        stage.subscribe(solved.append)
        link = stage.join(hello("camera_0"))
        stage.start_recording("day", "take")
        path = tmp_path / "day" / "take"

        def send(sequence):
            now = time.monotonic_ns()
            message = frame(0, sequence, now, sequence / 30)
            stage.frame(link, message, wire.encode(message), now)
            time.sleep(0.01)

        for sequence in range(1, 31):
            send(sequence)
        raw = path / "raw.mcap"
        wait_until(lambda: stage.status().recording.frames >= 30, "they are recorded")
        assert stage.results.get()[0] == 0
        assert stage.status().pipeline.preparing
        wait_until(lambda: len(shown) > 0, "what the camera sees is shown meanwhile")
        assert not solved
        check_is_what_the_camera_sees(shown[-1], stage)
        readiness.set()
        sequence = 30
        while stage.results.get()[0] < 4:
            sequence += 1
            send(sequence)
        wait_until(lambda: not stage.status().pipeline.preparing, "it says that it is ready")
        assert solved and np.isfinite(solved[-1].positions_m).all()
        assert shown[-1] is solved[-1]
        stage.stop_recording()
    finally:
        stage.close()
    starts = [
        one.event for one in read_raw(raw) if isinstance(one, RawEvent) and isinstance(one.event, StartEvent)
    ]
    assert starts[0].calibration is None and starts[-1].calibration is not None
    assert inspect_raw(raw).frames["camera_0"] == sequence
    assert "live" in Take.open(path).solve_names()


def check_is_what_the_camera_sees(step: StepResult, stage: LiveStage) -> None:
    """A step has one camera's joints, on the stage, and no body."""
    assert step.frame_set.cameras == ("camera_0",)
    assert np.isnan(step.positions_m).all()
    calibration = stage.calibration()
    assert calibration is not None
    T_stage_camera = calibration.cameras["camera_0"].T_stage_camera
    sent = [decoded_positions(sequence) for sequence in range(1, 31)]
    placed = [one @ T_stage_camera[:3, :3].T + T_stage_camera[:3, 3] for one in sent]
    assert min(np.nanmax(np.abs(one - step.frame_set.positions[0])) for one in placed) < 1e-6


def decoded_positions(sequence: int) -> np.ndarray:
    """The canonical joints of the frame of that sequence, in the camera's frame."""
    message = wire.decode(wire.encode(frame(0, sequence, 0, sequence / 30)))
    assert isinstance(message, wire.SkeletonFrame)
    return camera_frame("camera_0", "canonical", message).positions


DEPTH, PICTURES = (
    Calibration("a", {"a": CameraCalibration(np.eye(4), lens=lens)}) for lens in (None, usual_lens(1280, 720))
)


@pytest.fixture
def calls(monkeypatch) -> list[str]:
    """What is prepared, in order, in a process in which nothing is ready."""
    calls: list[str] = []
    for name in ("prepare_one", "prepare_pictures", "prepare_several"):
        monkeypatch.setattr(f"studio.offline.warming.{name}", lambda name=name: calls.append(name))
    for name in ("_ready", "_ready_for_pictures", "_wanted"):
        monkeypatch.setattr(warmup, name, threading.Event())
    return calls


def test_cameras_without_depth_are_prepared_after_those_with_it(calls):

    def then() -> None:
        calls.append(f"{warmup.is_ready(DEPTH)} {warmup.is_ready(PICTURES)}")

    warmup.begin(then)
    wait_until(lambda: len(calls) == 5, "all is prepared")
    assert calls == ["prepare_one", "True False", "prepare_pictures", "True True", "prepare_several"]


def test_cameras_without_depth_are_prepared_for_once_they_are_there_else_after_a_pause(calls, monkeypatch):
    monkeypatch.setattr(warmup, "PAUSE_S", 3600.0)
    told = threading.Event()
    warmup.begin(told.set)
    assert told.wait(60) and warmup.is_ready() and calls == ["prepare_one"]
    assert not warmup.is_ready(PICTURES)
    wait_until(lambda: len(calls) == 3, "all is prepared")


@pytest.mark.parametrize("case", ["camera", "calibration", "now"])
def test_nothing_is_prepared_before_it_may_be_needed(tmp_path, calls, case):
    if case == "calibration":
        save_stage_calibration(tmp_path, ["camera_0"])
    stage = LiveStage(tmp_path)
    stage.start(prepare=case != "now")
    try:
        stage.set_settings(stage.settings())  # the engine has handled all that came before
        if case == "camera":
            assert calls == [] and not stage.status().pipeline.preparing
            stage.join(hello("camera_0"))
            stage.join(hello("camera_1"))
        if case == "now":
            assert calls == []
            stage.prepare(now=True)
        wait_until(lambda: len(calls) == 3, "all is prepared")
        assert calls == ["prepare_one", "prepare_pictures", "prepare_several"]
        wait_until(lambda: not stage.status().pipeline.preparing, "it says so")
    finally:
        stage.close()


def test_what_cannot_be_made_ready_is_told_and_begins_anyway(monkeypatch, caplog):
    def fails():
        raise OSError("made to fail")

    monkeypatch.setattr("studio.offline.warming.prepare_one", fails)
    monkeypatch.setattr(warmup, "_ready", threading.Event())
    began = threading.Event()
    with caplog.at_level("ERROR"):
        warmup.begin(began.set)
        assert began.wait(60)
    assert warmup.is_ready() and "could not be made ready" in caplog.text

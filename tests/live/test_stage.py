"""The live stage where things go wrong inside: the pipeline fails, the disk fails."""

import logging
import os
import time

import pytest

from studio import wire
from studio.engine.base.errors import StudioError, TakeError
from studio.engine.solve.pipeline import Pipeline
from studio.live import CameraRefused, LiveStage
from studio.live.cameras.links import LINK_TIMEOUT_NS
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter, inspect_raw
from tests.api.camera import wait_until
from tests.live.performer import frame, hello, save_stage_calibration
from tests.refused import refused


@pytest.fixture
def stage(tmp_path):
    save_stage_calibration(tmp_path, ["camera_0"])
    stage = LiveStage(tmp_path)
    stage.start()
    yield stage
    stage.close()


def feed(stage, link, count):
    """Send so many frames, in real time so that each is due."""
    for _ in range(count):
        link.sequence = getattr(link, "sequence", 0) + 1
        now = time.monotonic_ns()
        message = frame(0, link.sequence, now, link.sequence / 30)
        stage.frame(link, message, wire.encode(message), now)
        time.sleep(0.01)


def feed_until(stage, link, happened, what):
    wait_until(lambda: (feed(stage, link, 1), happened())[1], what)


def test_a_pipeline_that_fails_is_started_afresh(stage, monkeypatch, caplog):
    link = stage.join(hello("camera_0"))
    feed_until(stage, link, lambda: stage.results.get()[0] > 3, "poses come")
    whole = Pipeline.step

    def broken(self, *_):
        monkeypatch.setattr(Pipeline, "step", whole)
        raise ZeroDivisionError("made to fail")

    with caplog.at_level(logging.CRITICAL):
        monkeypatch.setattr(Pipeline, "step", broken)
        feed_until(stage, link, lambda: stage.status().pipeline.failures == 1, "it failed")
    seen = stage.results.get()[0]
    feed_until(stage, link, lambda: stage.results.get()[0] > seen + 3, "poses come again")
    assert "made to fail" in stage.status().pipeline.problem


def test_a_disk_that_fails_is_told_and_the_stage_goes_on(stage, monkeypatch, caplog):
    link = stage.join(hello("camera_0"))
    stage.start_recording("s", "t")

    def full(self):
        raise OSError(28, os.strerror(28))

    with caplog.at_level(logging.CRITICAL):
        monkeypatch.setattr(RawWriter, "write_out", full)
        feed_until(stage, link, lambda: stage.status().recording.problem != "", "it is told")
        assert "No space left" in stage.status().recording.problem
        feed_until(stage, link, lambda: not stage.status().recording.active, "the recording has ended")
    assert "No space left" in stage.status().recording.problem
    seen = stage.results.get()[0]
    feed_until(stage, link, lambda: stage.results.get()[0] > seen + 3, "poses come")


def test_all_that_was_sent_is_recorded_while_the_engine_is_busy(stage, tmp_path):
    link = stage.join(hello("camera_0"))
    stage.start_recording("s", "t")
    for k in range(300):
        now = time.monotonic_ns()
        message = frame(0, k, now, k / 30)
        stage.frame(link, message, wire.encode(message), now)
    assert stage.stop_recording().frames == 300
    raw = inspect_raw(Take.open(tmp_path / "s" / "t").raw_path)
    assert raw.frames == {"camera_0": 300} and raw.complete
    assert stage.status().cameras["camera_0"].skipped > 0


@pytest.mark.parametrize("session", ["blind", "calibrations", "performers", "rigs", "shares"])
def test_no_session_takes_a_folder_of_the_stage(stage, session):
    with refused(TakeError, "recording.session_reserved"):
        stage.start_recording(session, "t")


def test_a_name_may_be_taken_over_once_its_client_is_silent(tmp_path):
    now = [10**12]
    stage = LiveStage(tmp_path, clock_ns=lambda: now[0])
    stage.start()
    old = stage.join(hello("camera_0"))
    with refused(CameraRefused, "camera.name_taken"):
        stage.join(hello("camera_0", boot_id="boot-2"))
    now[0] += LINK_TIMEOUT_NS
    new = stage.join(hello("camera_0", boot_id="boot-2"))
    with refused(CameraRefused, "camera.taken_over"):
        stage.client_status(old, wire.Status(1, 0))
    stage.leave(old, "closed")
    stage.client_status(new, wire.Status(1, 0))
    assert stage.status().cameras["camera_0"].connected
    stage.close()


def test_a_stage_that_ended_says_so(tmp_path):
    stage = LiveStage(tmp_path)
    stage.start()
    stage.close()
    stage.close()
    with refused(StudioError, "stage.ended"):
        stage.start_recording()


def test_a_subscriber_gets_every_step_until_it_ends(stage):
    got = []
    end = stage.subscribe(got.append)
    link = stage.join(hello("camera_0"))
    feed_until(stage, link, lambda: len(got) > 3, "steps come")
    end()
    count, seen = len(got), stage.results.get()[0]
    feed_until(stage, link, lambda: stage.results.get()[0] > seen + 3, "more steps come")
    assert len(got) <= count + 1

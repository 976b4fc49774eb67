"""The status of the live stage as JSON: programs depend on its keys, their order and their values."""

import json
import re
from pathlib import Path
from typing import Any

import msgspec

from studio import wire
from studio.engine.calibration.views.seen.known_lens import KnownLenses
from studio.live import LiveStage
from studio.live.calibration.calibrator import Outcome
from studio.live.inbox import Arrived, Left
from studio.live.recording.recorder import Recorder
from studio.live.recording.recording import LiveRecording
from studio.take.folder.marker import Restart
from studio.take.raw.frames import camera_frame
from tests.live.performer import calibration, frame, hello, save_stage_calibration

SNAPSHOT = Path(__file__).with_name("status.json")
"""The status from before it had types; a float stands as the word `float`."""


class Clock:
    """A clock that the test moves on."""

    ns = 1_000_000_000

    def __call__(self) -> int:
        return self.ns


def shape(value: Any) -> Any:
    """JSON with the word `float` for every float."""
    if isinstance(value, dict):
        return {key: shape(item) for key, item in value.items()}
    if isinstance(value, list):
        return [shape(item) for item in value]
    if isinstance(value, str):
        return re.sub(r"\d\d:\d\d:\d\d;", "HH:MM:SS;", value)  # of the time zone
    return "float" if isinstance(value, float) else value


def run(stage: LiveStage, seconds: float, *, cameras: int = 2) -> None:
    """Frames of a performer from cameras whose clocks are the server's, on this thread in the engine's place."""
    engine = stage._engine
    for _ in range(round(30 * seconds)):
        now = stage.clock_ns.ns = stage.clock_ns.ns + 33_333_333
        for index in range(cameras):
            name, number = f"camera_{index}", now // 33_333_333
            seen = frame(index, number, now, 1.5)
            arrived = Arrived(camera_frame(name, "canonical", seen), wire.encode(seen), now, hello(name))
            engine._frame(arrived, late=False)
        engine._tick()
        engine._housekeeping()


def told(stage: LiveStage) -> Any:
    stage._engine._refresh()
    return shape(json.loads(msgspec.json.encode(stage.status(), enc_hook=str)))


def told_in_time(folder: Path) -> dict[str, Any]:
    """The status of a stage in one state after the other."""
    out = {"empty": told(LiveStage(folder / "empty", clock_ns=Clock()))}
    save_stage_calibration(folder / "day", ["camera_0", "camera_1"])
    stage = LiveStage(folder / "day", clock_ns=Clock())
    engine = stage._engine
    for name in ("camera_0", "camera_1"):
        engine.join_camera(hello(name), local=name == "camera_1")
    stage.refuse("another one of that name")
    out["no frame yet"] = told(stage)
    now = stage.clock_ns()
    sample = wire.ClockSample(now, now + 1_000_000, now + 1_000_000, now + 2_000_000)
    engine._measured(engine.roster.cameras["camera_0"], sample)
    run(stage, 3.0)
    engine.roster.cameras["camera_0"].client = wire.Status(10, 1, "a word", 2, 3, 4, 5, 6)
    engine.start_calibration(20.0, None, KnownLenses())
    engine.start_tpose("Ada", 1.5)
    run(stage, 2.5)
    assert engine.calibrator._estimating is not None
    engine.calibrator._estimating.join()
    out["live"] = told(stage)
    recorder = Recorder.create(folder / "day" / "s" / "t", session="s", name="t")
    recording = LiveRecording(recorder, stage.clock_ns(), (Restart("2026-05-02T12:00:00+00:00", 120),))
    engine.attach(recording)
    run(stage, 0.5)
    out["recorded"] = told(stage)
    engine._handle([Left("camera_1", "it is gone", True)])
    engine._calibrated(Outcome(calibration(["camera_0"]), None, "too little was seen", False))
    out["gone"] = told(stage)
    engine.detach()
    recorder.close()
    return out


def test_the_json_of_the_status_is_as_it_was(tmp_path):
    expected = json.loads(SNAPSHOT.read_text(encoding="utf-8"))
    for state, found in told_in_time(tmp_path).items():
        assert found == expected[state], state
        assert json.dumps(found) == json.dumps(expected[state]), f"{state}: the order of the keys"

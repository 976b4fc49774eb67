"""raw.mcap: it is read as it was written, and what a crash or a bad disk leaves can be read."""

import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from studio import wire
from studio.engine.base.errors import FormatError, TakeError
from studio.engine.model.frames import ClockModel
from studio.engine.model.joints import INDEX, JOINT_SETS
from studio.take.folder.lock import is_held
from studio.take.raw.frames import (
    RawCamera,
    RawEvent,
    RawFrame,
    RawReader,
    RawWriter,
    camera_frames,
    inspect_raw,
    read_raw,
)
from studio.take.raw.live_log import (
    CalibrationEvent,
    ClockEvent,
    JoinedEvent,
    LoggedPipeline,
    SettingsEvent,
    StartEvent,
    StoppedEvent,
    TickEvent,
    UnknownEvent,
    read_event,
)
from tests.refused import refused
from tests.take.helpers import FRAME_NS, hello, message, write_frames

NAMES = ["camera_0", "camera_1"]


def write_raw(path: Path, count: int = 40) -> Path:
    with RawWriter(path) as writer:
        for name in NAMES:
            writer.add_camera(hello(name))
        write_frames(writer, NAMES, 0, count)
    return path


def frame_keys(path: Path) -> list[tuple[str, int]]:
    return [(r.camera, r.frame.sequence) for r in read_raw(path) if isinstance(r, RawFrame)]


def test_everything_comes_back_in_file_order(tmp_path: Path) -> None:
    records = list(read_raw(write_raw(tmp_path / "raw.mcap", 3)))
    kinds = [type(record) for record in records]
    assert kinds == [RawCamera, RawCamera, *([RawFrame, RawFrame, RawEvent] * 3)]
    frame = records[3]
    assert isinstance(frame, RawFrame)
    sent = message(0, 1)
    assert frame.camera == "camera_1" and frame.message == sent
    assert frame.arrival_ns == 5_000_000
    positions, confidence = wire.joint_arrays(sent, "canonical")
    np.testing.assert_array_equal(frame.frame.positions, positions)
    assert np.isnan(frame.frame.positions[0]).all() and frame.frame.confidence[0] == 0.0
    np.testing.assert_array_equal(frame.frame.confidence[1:], confidence[1:])
    assert frame.frame.hands[0].open_probability == 0.25 and frame.frame.head_wxyz == (1.0, 0.0, 0.0, 0.0)
    assert records[-1] == RawEvent(2 * FRAME_NS, TickEvent(2 * FRAME_NS))


def test_event_numbers_come_back_bit_for_bit(tmp_path: Path) -> None:
    numbers = [*np.random.default_rng(0).normal(size=200).tolist(), 1e-300, 2**62, 0.1]
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.event(1, SettingsEvent({"numbers": numbers}))
    (record,) = (r for r in read_raw(tmp_path / "raw.mcap") if isinstance(r, RawEvent))
    assert record.event == SettingsEvent({"numbers": numbers})


def test_device_joints_become_canonical(tmp_path: Path) -> None:
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(hello("k", "kinect-v2"))
        data = wire.encode(message(30, joint_set="kinect-v2"))
        writer.frame("k", data, arrival_ns=1, device_time_ns=2, sequence=30)
    (frame,) = camera_frames(tmp_path / "raw.mcap")["k"]
    assert frame.positions.shape == (21, 3) and np.isfinite(frame.positions[0]).all()


def test_landmarks_of_a_picture_become_canonical(tmp_path: Path) -> None:
    names = JOINT_SETS["mediapipe"]
    pixels = np.column_stack([np.arange(33.0), 2 * np.arange(33.0)])
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(hello("phone", "mediapipe"))
        for k in range(300):  # more than stay in memory as one block
            seen = wire.LandmarkArrays(640, 480 + k, pixels + k)
            sent = wire.landmark_frame(k, k, seen, np.where(np.arange(33) == 2, 0.2, 0.9))
            writer.frame("phone", wire.encode(sent), arrival_ns=k, device_time_ns=k, sequence=k)
    frames = camera_frames(tmp_path / "raw.mcap")["phone"]
    for k in (0, 299):
        frame, picture = frames[k], frames[k].picture
        assert picture is not None and (picture.width, picture.height) == (640, 480 + k)
        assert np.isnan(frame.positions).all() and np.isnan(picture.world_m).all()
        wrist = names.index("left_wrist")
        hips, shoulders = (
            [names.index(f"{s}_{part}") for s in ("left", "right")] for part in ("hip", "shoulder")
        )
        low, high = pixels[hips].mean(axis=0), pixels[shoulders].mean(axis=0)
        assert picture.pixels[INDEX["left_wrist"]] == pytest.approx(pixels[wrist] + k)
        assert picture.pixels[INDEX["hips"]] == pytest.approx(0.881 * low + 0.119 * high + k)
        assert picture.face is not None and np.isnan(picture.face[2]).all()  # hardly visible
        others = [0, 1, *range(3, 11)]
        assert picture.face[others] == pytest.approx(pixels[others] + k)
        assert (
            frame.confidence[INDEX["hips"]] == pytest.approx(0.9, abs=1e-6)
            and np.isnan(picture.pixels[1]).all()
        )


def test_camera_frames_are_ordered_and_once(tmp_path: Path) -> None:
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(hello("b"))
        writer.add_camera(hello("a"))
        for k in (0, 2, 1, 2, 3):
            writer.frame("b", wire.encode(message(k)), arrival_ns=k, device_time_ns=k * FRAME_NS, sequence=k)
    frames = camera_frames(tmp_path / "raw.mcap")
    assert list(frames) == ["b", "a"] and len(frames["a"]) == 0
    assert [f.sequence for f in frames["b"]] == [0, 1, 2, 3]


def test_a_camera_may_come_back_with_another_joint_set(tmp_path: Path) -> None:
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(hello("c"))
        writer.frame("c", wire.encode(message(0)), arrival_ns=0, device_time_ns=0, sequence=0)
        writer.add_camera(hello("c", "kinect-v2", boot_id="boot-2"))
        data = wire.encode(message(1, joint_set="kinect-v2"))
        writer.frame("c", data, arrival_ns=1, device_time_ns=FRAME_NS, sequence=1)
    records = list(read_raw(tmp_path / "raw.mcap"))
    assert [r.hello.boot_id for r in records if isinstance(r, RawCamera)] == ["boot-1", "boot-2"]
    assert len(camera_frames(tmp_path / "raw.mcap")["c"]) == 2


def test_the_token_is_not_written(tmp_path: Path) -> None:
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(hello("c", token="hush-hush"))
        writer.frame("c", wire.encode(message(0)), arrival_ns=0, device_time_ns=0, sequence=0)
    (camera,) = (r for r in read_raw(tmp_path / "raw.mcap") if isinstance(r, RawCamera))
    assert camera.hello.token == ""
    assert b"hush-hush" not in (tmp_path / "raw.mcap").read_bytes()


def test_mcap_fields_are_those_of_the_frame(tmp_path: Path) -> None:
    with open(write_raw(tmp_path / "raw.mcap", 2), "rb") as file:
        messages = [
            (c.topic, m.log_time, m.publish_time, m.sequence) for _, c, m in make_reader(file).iter_messages()
        ]
    assert ("camera/camera_1/skeleton", FRAME_NS + 5_000_000, FRAME_NS, 1) in messages
    assert ("live", FRAME_NS, FRAME_NS, 0) in messages


def test_raw_is_never_overwritten_and_marked_while_written(tmp_path: Path) -> None:
    writer = RawWriter(tmp_path / "raw.mcap")
    with refused(TakeError, "raw.exists"):
        RawWriter(tmp_path / "raw.mcap")
    assert is_held(tmp_path / "raw.mcap")
    writer.close()
    writer.close()
    assert not is_held(tmp_path / "raw.mcap")


def test_a_full_disk_is_a_clear_error(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    writer = RawWriter(tmp_path / "raw.mcap")
    writer.add_camera(hello("camera_0"))
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with refused(TakeError, "file.unwritable_free_space"):
            for k in range(20):
                write_frames(writer, ["camera_0"], 10 * k, 10)
                writer.flush()
        with refused(TakeError, "file.unwritable_free_space"):
            writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not is_held(tmp_path / "raw.mcap")
    assert len(frame_keys(tmp_path / "raw.mcap")) >= 10


def test_a_missing_file_is_a_clear_error(tmp_path: Path) -> None:
    with refused(TakeError, "take.no_raw"):
        read_raw(tmp_path / "raw.mcap")


def test_flush_puts_everything_in_the_file(tmp_path: Path) -> None:
    writer = RawWriter(tmp_path / "raw.mcap")
    for name in NAMES:
        writer.add_camera(hello(name))
    write_frames(writer, NAMES, 0, 7)
    writer.flush()
    write_frames(writer, NAMES, 7, 1)
    shutil.copy(tmp_path / "raw.mcap", tmp_path / "copy.mcap")
    writer.close()
    summary = inspect_raw(tmp_path / "copy.mcap")
    assert summary.frames == {"camera_0": 7, "camera_1": 7} and summary.events == 7
    assert not summary.complete and "not finished" in (summary.problem or "")
    whole = inspect_raw(tmp_path / "raw.mcap")
    assert whole.complete and whole.problem is None and whole.frames["camera_0"] == 8


_KILLED = """
import sys
from studio.take.raw.frames import RawWriter
from tests.take.helpers import hello, write_frames
from tests.refused import refused
writer = RawWriter(sys.argv[1])
writer.add_camera(hello("camera_0"))
write_frames(writer, ["camera_0"], 0, 25)
writer.flush()
write_frames(writer, ["camera_0"], 25, 3)
print("flushed", flush=True)
sys.stdin.read()
"""


def test_a_killed_program_loses_nothing_before_the_flush(tmp_path: Path) -> None:
    raw = tmp_path / "raw.mcap"
    root = str(Path(__file__).parents[2])
    with subprocess.Popen(
        [sys.executable, "-c", _KILLED, str(raw)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=root,
        env=os.environ | {"PYTHONPATH": root},
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == b"flushed\n"
        assert is_held(raw)
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert not is_held(raw)
    assert [key[1] for key in frame_keys(raw)] == list(range(25))


def test_a_file_cut_anywhere_gives_all_frames_before_the_last_flush(tmp_path: Path) -> None:
    writer = RawWriter(tmp_path / "raw.mcap")
    for name in NAMES:
        writer.add_camera(hello(name))
    flushed = []
    for k in range(6):
        write_frames(writer, NAMES, 5 * k, 5)
        writer.flush()
        flushed.append(((tmp_path / "raw.mcap").stat().st_size, 10 * (k + 1)))
    writer.close()
    data = (tmp_path / "raw.mcap").read_bytes()
    everything = frame_keys(tmp_path / "raw.mcap")
    cut = tmp_path / "cut.mcap"
    rng = np.random.default_rng(7)
    places = {
        0,
        1,
        7,
        8,
        9,
        len(data) - 1,
        *(size for size, _ in flushed),
        *rng.integers(0, len(data), 250).tolist(),
    }
    for place in sorted(places):
        cut.write_bytes(data[:place])
        keys = frame_keys(cut)
        assert keys == everything[: len(keys)]
        assert len(keys) >= max((count for size, count in flushed if size <= place), default=0)
        assert not inspect_raw(cut).complete


def test_damaged_bytes_never_raise_and_never_give_wrong_frames(tmp_path: Path) -> None:
    writer = RawWriter(tmp_path / "raw.mcap")
    for name in NAMES:
        writer.add_camera(hello(name))
    for k in range(5):
        write_frames(writer, NAMES, 8 * k, 8)
        writer.flush()
    writer.close()
    data = (tmp_path / "raw.mcap").read_bytes()
    right = {
        (r.camera, r.message.sequence): r.message
        for r in read_raw(tmp_path / "raw.mcap")
        if isinstance(r, RawFrame)
    }
    rng = np.random.default_rng(3)
    broken = tmp_path / "broken.mcap"
    for _ in range(250):
        start, length = int(rng.integers(0, len(data))), int(rng.integers(1, 40))
        broken.write_bytes(data[:start] + rng.bytes(length) + data[start + length :])
        for record in read_raw(broken):
            if isinstance(record, RawFrame):
                assert right[record.camera, record.message.sequence] == record.message


def test_a_damaged_chunk_is_left_out_and_told(tmp_path: Path) -> None:
    writer = RawWriter(tmp_path / "raw.mcap")
    writer.add_camera(hello("camera_0"))
    sizes = []
    for k in range(3):
        write_frames(writer, ["camera_0"], 10 * k, 10)
        writer.flush()
        sizes.append((tmp_path / "raw.mcap").stat().st_size)
    writer.close()
    data = bytearray((tmp_path / "raw.mcap").read_bytes())
    data[sizes[0] + 300] ^= 0xFF  # inside the second chunk
    (tmp_path / "raw.mcap").write_bytes(data)
    reader = RawReader(tmp_path / "raw.mcap")
    numbers = [r.frame.sequence for r in reader if isinstance(r, RawFrame)]
    assert numbers == [*range(10), *range(20, 30)]
    assert not reader.complete and "chunk" in (reader.problem or "")


def test_a_frame_that_cannot_be_read_is_left_out_and_told(tmp_path: Path) -> None:
    with RawWriter(tmp_path / "raw.mcap") as writer:
        writer.add_camera(hello("camera_0"))
        writer.frame("camera_0", b"\x00garbage", arrival_ns=0, device_time_ns=0, sequence=0)
        wrong = wire.encode(message(1, joint_set="kinect-v2"))
        writer.frame("camera_0", wrong, arrival_ns=1, device_time_ns=1, sequence=1)
        write_frames(writer, ["camera_0"], 2, 1)
    summary = inspect_raw(tmp_path / "raw.mcap")
    assert summary.frames == {"camera_0": 1} and not summary.complete
    assert "camera_0" in (summary.problem or "")


OLD_LOG = (
    b'{"type":"start","calibration":null,"settings":{"smoothing":"none"}}',
    b'{"type":"clock","camera":"camera_0","offset_ns":5,"drift_ppm":0,"reference_ns":7}',
    b'{"type":"calibration","calibration":{"cameras":{}}}',
    b'{"type":"skipped","camera":"camera_0","sequence":3}',
    b'{"type":"tick","stage_time_ns":16666667,"more":[1]}',
    b'{"type":"segment","camera":"camera_0","boot_id":"b","from_sequence":4,"clock_id":"b#1"}',
    b'{"type":"stage_clock","camera":"camera_0","clock_id":"b","offset_ns":1,"drift_ppm":0.5,"reference_ns":2}',
    b'{"type":"joined","camera":"camera_0","boot_id":"b"}',
    b'{"type":"restart","gap_ms":120}',
    b'{"type":"stopped"}',
)
"""Lines as earlier versions wrote them, or a later one may: without what came later, with what is not known."""


def test_events_of_every_version_are_read() -> None:
    assert read_event(OLD_LOG[0]) == StartEvent(None, {"smoothing": "none"})
    clock = read_event(OLD_LOG[1])
    assert isinstance(clock, ClockEvent) and clock.clock_id is None and clock.model == ClockModel(5, 0.0, 7)
    assert isinstance(read_event(OLD_LOG[2]), CalibrationEvent)
    assert read_event(OLD_LOG[4]) == TickEvent(16666667)
    assert read_event(OLD_LOG[7]) == JoinedEvent("camera_0", "b", 0)
    assert read_event(OLD_LOG[9]) == StoppedEvent(None)
    assert not any(isinstance(read_event(line), UnknownEvent) for line in OLD_LOG)
    for line in (b'{"type":"dance"}', b'{"type":"tick"}', b"[]"):  # only a replay as live needs them
        event = read_event(line)
        with refused(FormatError, "take.event_unreadable"):
            LoggedPipeline().event(event)
    with pytest.raises(FormatError):
        read_event(b'{"type":')

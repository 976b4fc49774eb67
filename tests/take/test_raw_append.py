"""Going on with a raw.mcap: after a cut anywhere, and behind a finished file; every MCAP reader reads the result."""

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from studio import wire
from studio.engine.base.errors import TakeError
from studio.take.folder.marker import MARKER, RECORDING, RecordingMarker, machine, read_marker, write_marker
from studio.take.folder.take import Take
from studio.take.raw.append import scan_raw
from studio.take.raw.frames import RawCamera, RawFrame, RawWriter, camera_frames, inspect_raw, read_raw
from studio.take.raw.pose_log import POSE_LOG, RECORD, PoseLog, read_records
from studio.take.raw.ranges import Ranges
from studio.take.raw.records import camera_frame
from studio.take.upkeep.doctor import check_takes
from tests.refused import refused
from tests.take.helpers import hello, message, write_frames

NAMES = ["camera_0", "camera_1"]


def write_raw(path: Path, count: int) -> list[int]:
    """Write so many frames, a chunk every five; return the file's size after each chunk."""
    sizes = []
    with RawWriter(path) as writer:
        for name in NAMES:
            writer.add_camera(hello(name))
        for first in range(0, count, 5):
            write_frames(writer, NAMES, first, 5)
            writer.flush()
            sizes.append(path.stat().st_size)
    return sizes


def numbers(path: Path, name: str = "camera_0") -> list[int]:
    return [r.frame.sequence for r in read_raw(path) if isinstance(r, RawFrame) and r.camera == name]


def indexed(path: Path) -> int:
    """How many messages another reader finds by the file's index."""
    with open(path, "rb") as file:
        return sum(1 for _ in make_reader(file).iter_messages())


def test_a_finished_file_is_gone_on_with(tmp_path: Path) -> None:
    raw = tmp_path / "raw.mcap"
    write_raw(raw, 20)
    for first in (20, 30):
        state = scan_raw(raw)
        assert (
            state.torn == 0
            and state.ticks == first
            and list(state.frames["camera_0", "boot-1"]) == [(0, first - 1)]
        )
        with RawWriter(raw, state=state) as writer:
            write_frames(writer, NAMES, first, 10)
    assert numbers(raw) == list(range(40)) and inspect_raw(raw).complete
    assert indexed(raw) == 3 * 40 and not list(tmp_path.glob("raw.torn*"))
    assert sum(isinstance(r, RawCamera) for r in read_raw(raw)) == 2


def test_a_file_cut_anywhere_is_gone_on_with_and_loses_nothing_that_was_flushed(tmp_path: Path) -> None:
    raw = tmp_path / "whole" / "raw.mcap"
    raw.parent.mkdir()
    sizes = write_raw(raw, 20)
    data = raw.read_bytes()
    places = np.random.default_rng(4).integers(0, len(data), 40).tolist()
    for number, place in enumerate(sorted({0, 3, 8, 20, *sizes, *places})):
        cut = tmp_path / str(number) / "raw.mcap"
        cut.parent.mkdir()
        cut.write_bytes(data[:place])
        state = scan_raw(cut)
        with RawWriter(cut, state=state) as writer:
            for name in NAMES:
                if (name, "boot-1") not in state.hellos:
                    writer.add_camera(hello(name))
            write_frames(writer, NAMES, 100, 5)
        flushed = 5 * sum(size <= place for size in sizes)
        found = numbers(cut)
        assert found[-5:] == list(range(100, 105)) and found[:-5] == list(range(len(found) - 5))
        assert len(found) - 5 >= flushed and inspect_raw(cut).complete
        assert indexed(cut) == sum(inspect_raw(cut).frames.values()) + inspect_raw(cut).events


def test_late_frames_are_told_apart_and_come_once_in_order(tmp_path: Path) -> None:
    raw = tmp_path / "raw.mcap"
    write_raw(raw, 10)
    with RawWriter(raw, state=scan_raw(raw)) as writer:
        for k in (14, 12, 13, 11, 10):
            frame = camera_frame("camera_0", "canonical", message(k))
            writer.late_frame(hello("camera_0"), wire.encode(message(k)), arrival_ns=k, frame=frame)
        early = hello("camera_0", boot_id="boot-0")
        frame = camera_frame("camera_0", "canonical", message(3))
        writer.late_frame(early, wire.encode(message(3)), arrival_ns=9, frame=frame)
    late = [r for r in read_raw(raw) if isinstance(r, RawFrame) and r.late]
    assert [(r.boot_id, r.frame.sequence) for r in late] == [
        *(("boot-1", k) for k in (14, 12, 13, 11, 10)),
        ("boot-0", 3),
    ]
    assert [f.sequence for f in camera_frames(raw)["camera_0"]] == list(range(15))
    state = scan_raw(raw)
    assert list(state.frames["camera_0", "boot-1"]) == [(0, 14)] and ("camera_0", "boot-0") in state.hellos
    assert [h.boot_id for h in inspect_raw(raw).hellos] == ["boot-1", "boot-1", "boot-0"]


def test_two_programs_do_not_write_one_file(tmp_path: Path) -> None:
    writer = RawWriter(tmp_path / "raw.mcap")
    with refused(TakeError, "raw.in_use"):
        RawWriter(tmp_path / "raw.mcap", state=scan_raw(tmp_path / "raw.mcap"))
    writer.close()


def test_ranges() -> None:
    ranges, rng = Ranges(), np.random.default_rng(1)
    order = rng.permutation(300)[:200].tolist()
    assert all(ranges.add(number) for number in order) and not any(ranges.add(number) for number in order)
    there = set(order)
    assert ranges.count == 200 and all((n in ranges) == (n in there) for n in range(-5, 305))
    gaps = {n for begin, end in ranges.gaps(-3, 310) for n in range(begin, end + 1)}
    assert gaps == set(range(-3, 311)) - there
    assert list(Ranges().gaps(2, 4)) == [(2, 4)] and Ranges().last is None


def crashed_live_take(sessions: Path) -> Take:
    """A live take whose server was killed: torn raw file, live poses, the mark of the recording."""
    take = Take.create(sessions / "day" / "take_001", session="day", name="take_001", source="live")
    write_raw(take.raw_path, 20)
    state = scan_raw(take.raw_path)
    with RawWriter(take.raw_path, state=state) as writer:
        writer.event(1, {"type": "start", "calibration": None, "settings": preset_json()})
        write_frames(writer, NAMES, 20, 5)
    data = take.raw_path.read_bytes()
    take.raw_path.write_bytes(data[: scan_raw(take.raw_path).end + 5])
    records = np.zeros(40, dtype=RECORD)
    records["tick"] = np.arange(40)
    records["rotations_wxyz"][..., 0] = 1.0
    (take.path / POSE_LOG).write_bytes(records.tobytes() + b"torn")
    write_marker(sessions, RecordingMarker("day", "take_001", "0a1b", RECORDING, 1, 2, 3, machine()))
    return take


def preset_json() -> dict:
    from studio.engine.model.settings.settings import preset

    return json.loads(json.dumps(preset("studio").to_json()))


def test_doctor_ends_what_a_killed_server_left(tmp_path: Path) -> None:
    take = crashed_live_take(tmp_path)
    (take.path / ".take.json.abcd").write_text("half")
    (take.path / "solves" / ".live.partial-abcd").mkdir()
    told = check_takes(tmp_path, repair=False)
    assert told and not any(f.repaired for f in told) and read_marker(tmp_path) is not None
    findings = check_takes(tmp_path)
    assert all(f.repaired for f in findings), findings
    assert any(f.path.name == MARKER for f in findings) and any(f.path.name == POSE_LOG for f in findings)
    assert check_takes(tmp_path) == [] and read_marker(tmp_path) is None
    assert take.solve_names() == ["live"] and not (take.path / POSE_LOG).exists()
    assert inspect_raw(take.raw_path).complete and inspect_raw(take.raw_path).frames["camera_0"] == 25


def test_live_poses_are_cut_to_the_log(tmp_path: Path) -> None:
    take = crashed_live_take(tmp_path)
    PoseLog(take.path / POSE_LOG, ticks=25).close()
    assert read_records(take.path / POSE_LOG)["tick"].tolist() == list(range(25))


@pytest.mark.parametrize("text", ["", "{", "[]", '{"session": "../up"}'])
def test_a_mark_that_cannot_be_read_is_none(tmp_path: Path, text: str) -> None:
    (tmp_path / MARKER).write_text(text)
    assert read_marker(tmp_path) is None
    (finding,) = check_takes(tmp_path)
    assert finding.repaired and not (tmp_path / MARKER).exists()

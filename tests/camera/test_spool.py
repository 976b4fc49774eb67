"""The spool: kept frames outlive the program, in order and within limits; damage loses only the damaged frames."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from studio import wire
from studio.camera.client.keeper import RECENT, Keeper
from studio.camera.client.spool import SEGMENT_BYTES, Origin, Spool
from studio.engine.base.errors import SettingsError
from tests.live.performer import hello
from tests.refused import refused

TAKE = Origin("day/take_001", "0a1b", hello("camera_0", token="hush"))
OTHER = Origin("day/take_002", "0a1c", hello("camera_0"))


def keep(spool: Spool, numbers: range, origin: Origin = TAKE) -> None:
    for number in numbers:
        assert spool.append(origin, number, b"frame %d" % number)


def test_frames_come_back_after_the_program_ended(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool")
    keep(spool, range(10, 20))
    keep(spool, range(20, 25), OTHER)
    spool.close()
    again = Spool(tmp_path / "spool")
    assert [origin.take_id for origin in again.origins()] == ["0a1b", "0a1c"]
    assert again.origins()[0].hello.name == "camera_0" and again.origins()[0].hello.token == ""
    assert again.sequences(TAKE.key) == list(range(10, 20)) and again.frames == 15
    assert again.read(OTHER.key, 22) == b"frame 22" and again.read(TAKE.key, 22) is None
    again.close()


def test_what_is_acknowledged_goes_and_an_empty_spool_leaves_nothing(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool")
    keep(spool, range(10))
    assert spool.acknowledge(TAKE.key, 6, [(2, 3)]) == [0, 1, 4, 5, 6]
    assert spool.sequences(TAKE.key) == [2, 3, 7, 8, 9]
    spool.acknowledge(TAKE.key, wire.ENDED, [])
    assert spool.frames == 0
    spool.close()
    assert not (tmp_path / "spool").exists()


def test_segments_are_deleted_as_they_are_acknowledged(tmp_path: Path) -> None:
    spool, data = Spool(tmp_path / "spool"), bytes(SEGMENT_BYTES // 4)
    for number in range(12):
        spool.append(TAKE, number, data)
    files = len(list(spool.folder.iterdir()))
    spool.acknowledge(TAKE.key, 7, [])
    assert files >= 3 and len(list(spool.folder.iterdir())) < files
    assert spool.sequences(TAKE.key) == [8, 9, 10, 11]
    spool.close()


def test_a_full_spool_keeps_the_oldest_counts_the_newest_and_says_so(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool", max_bytes=2000)
    kept = [number for number in range(100) if spool.append(TAKE, number, b"x" * 100)]
    assert kept == list(range(len(kept))) and 5 < len(kept) < 20
    assert spool.refused == 100 - len(kept) and "full" in spool.problem
    spool.acknowledge(TAKE.key, wire.ENDED, [])
    spool.close()


def test_a_torn_end_costs_only_the_frame_that_it_touched(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool")
    keep(spool, range(5))
    spool.close()
    (file,) = (tmp_path / "spool").iterdir()
    whole = file.read_bytes()
    for place in range(len(whole) - 1, 0, -7):
        file.write_bytes(whole[:place])
        again = Spool(tmp_path / "spool")
        assert again.sequences(TAKE.key) == list(range(again.frames))
        again.close()
        (tmp_path / "spool").mkdir(exist_ok=True)


def test_two_clients_do_not_share_a_spool(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool")
    with refused(SettingsError, "spool.in_use"):
        Spool(tmp_path / "spool")
    spool.close()


_KILLED = """
import sys
from pathlib import Path
from studio.camera.client.spool import Spool
from tests.camera.test_spool import TAKE, keep
from tests.refused import refused
spool = Spool(Path(sys.argv[1]))
keep(spool, range(200))
print("kept", flush=True)
sys.stdin.read()
"""


def test_a_killed_client_loses_no_frame_that_it_kept(tmp_path: Path) -> None:
    root = str(Path(__file__).parents[2])
    command = [sys.executable, "-c", _KILLED, str(tmp_path / "spool")]
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=root,
        env=os.environ | {"PYTHONPATH": root},
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == b"kept\n"
        process.send_signal(signal.SIGKILL)
    spool = Spool(tmp_path / "spool")
    assert spool.sequences(TAKE.key) == list(range(200))
    spool.close()


def recording(active: bool = True, take_id: str = "0a1b") -> wire.Recording:
    return wire.Recording(active, "day/take_001", take_id, 5)


def drain(keeper: Keeper) -> list[bytes]:
    out = []
    while keeper.has_late and (late := keeper.next_late()) is not None:
        out.append(late.data)
    return out


@pytest.fixture
def keeper(tmp_path: Path):
    spool = Spool(tmp_path / "spool")
    keeper = Keeper(spool, hello("camera_0"), lambda: None)
    yield keeper
    spool.acknowledge(TAKE.key, wire.ENDED, [])
    spool.close()


def send(keeper: Keeper, numbers: range) -> None:
    for number in numbers:
        keeper.frame(number, b"frame %d" % number)
        keeper.sent(number)


def test_what_a_lost_link_swallowed_is_sent_again_in_order(keeper: Keeper) -> None:
    assert keeper.connected() == []
    send(keeper, range(3))
    (kept,) = keeper.recording_changed(recording())
    assert (kept.first, kept.last) == (0, 2)  # the take may have begun with what was on its way
    send(keeper, range(3, 10))
    keeper.acknowledged(wire.Ack("0a1b", "boot-1", 5))
    for number in range(10, 13):  # the link is down
        keeper.frame(number, b"frame %d" % number)
    (kept,) = keeper.connected()
    assert (kept.first, kept.last) == (6, 12) and not keeper.has_late
    keeper.acknowledged(wire.Ack("0a1b", "boot-1", 7))
    send(keeper, range(13, 14))
    assert drain(keeper) == [b"frame %d" % number for number in range(8, 13)]
    keeper.acknowledged(wire.Ack("0a1b", "boot-1", 13))
    assert keeper.owed == 0


def test_a_take_that_ended_while_the_link_was_down_is_completed(keeper: Keeper) -> None:
    keeper.connected()
    keeper.recording_changed(recording())
    send(keeper, range(5))
    keeper.connected()
    (kept,) = keeper.recording_changed(recording(active=False))
    assert (kept.first, kept.last) == (0, 4) and not keeper.recording
    keeper.acknowledged(wire.Ack("0a1b", "boot-1", 2))
    assert drain(keeper) == [b"frame 3", b"frame 4"]


def test_frames_outside_recordings_are_not_kept(keeper: Keeper) -> None:
    keeper.connected()
    send(keeper, range(3 * RECENT))
    assert keeper.owed == 0
    keeper.recording_changed(recording())
    assert keeper.owed == RECENT


UNKNOWN = wire.Ack("0a1b", "boot-1", -1, known=False)


def unknown_take(keeper: Keeper, frames: int) -> None:
    """Frames are kept for a take, and the link is lost."""
    keeper.connected()
    keeper.recording_changed(recording())
    send(keeper, range(frames))
    keeper.recording_changed(recording(active=False))
    keeper.connected()


def test_a_take_that_the_server_does_not_know_is_not_sent(keeper: Keeper, caplog) -> None:
    unknown_take(keeper, 3)
    keeper.acknowledged(UNKNOWN)
    assert drain(keeper) == [] and (keeper.owed, keeper.unknown) == (0, 3)
    assert "--drop-unknown" in caplog.text
    keeper.acknowledged(wire.Ack("0a1b", "boot-1", 0))  # the take is back: restored, or another studio
    assert (keeper.owed, keeper.unknown) == (2, 0)


def test_frames_of_an_unknown_take_stay_for_thirty_days(keeper: Keeper, tmp_path: Path) -> None:
    unknown_take(keeper, 3)
    (segment,) = tmp_path.rglob("*.spool")
    for days, left in ((29, 3), (31, 0)):
        then = time.time() - days * 86400.0
        os.utime(segment, (then, then))
        keeper.acknowledged(UNKNOWN)
        assert keeper.unknown == left and segment.exists() == bool(left)


def test_frames_of_an_unknown_take_are_dropped_when_the_operator_says_so(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool")
    keeper = Keeper(spool, hello("camera_0"), lambda: None, drop_unknown=True)
    unknown_take(keeper, 3)
    keeper.acknowledged(UNKNOWN)
    assert keeper.unknown == keeper.owed == 0 and spool.size_bytes == 0
    spool.close()


def test_frames_of_an_unknown_take_make_room(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool", max_bytes=2000)
    keep(spool, range(30))
    spool.unknown.add(TAKE.key)
    assert spool.append(Origin("day/b", "2b", TAKE.hello), 1, b"x" * 1000)
    assert spool.refused == 0 and spool.unknown_frames == 0 and [o.take for o in spool.origins()] == ["day/b"]
    spool.close()


def test_frames_of_a_camera_of_another_name_are_not_offered(keeper: Keeper, tmp_path: Path, caplog) -> None:
    keep(keeper._spool, range(3))
    other = Keeper(keeper._spool, hello("camera_7"), lambda: None)
    assert other.connected() == [] and (other.owed, other.unknown) == (0, 3)
    assert "camera_0" in caplog.text
    keeper._spool.unknown.clear()
    (kept,) = keeper.connected()
    assert (kept.take_id, kept.first, kept.last) == ("0a1b", 0, 2)

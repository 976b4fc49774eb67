"""Which frames belong to a recording, case by case: ways by which a frame of another time or client might get in."""

import threading
from pathlib import Path

import pytest
from msgspec.structs import replace

from studio import wire
from studio.camera.client.spool import Origin
from studio.live import LiveStage
from studio.live.inbox import Arrived
from studio.take.folder.marker import STOPPING, read_marker, write_marker
from studio.take.folder.take import Take
from studio.take.library.sessions import find_take, take_info
from studio.take.raw.append import scan_raw
from studio.take.raw.frames import RawFrame, camera_frame, inspect_raw, read_raw
from studio.take.raw.live_log import ClockEvent, JoinedEvent
from studio.take.raw.membership import AFTER, BEFORE, STRANGER, UNTIMED, Membership
from tests.live.clients import MS, NOBODY, Client, World
from tests.live.performer import hello
from tests.take.test_raw_append import crashed_live_take

SECOND = 1_000_000_000


@pytest.fixture
def world(tmp_path: Path):
    world = World(tmp_path)
    yield world
    world.end_server()
    for client in world.clients:
        client.end()


@pytest.fixture
def camera(world: World, tmp_path: Path) -> Client:
    camera = Client(world, "camera_0", tmp_path / "spool")
    camera.connect()
    world.run(3)
    return camera


def sequences(world: World, take: str = "take_001") -> dict[str, list[int]]:
    """Numbers of the frames of a take by start of the client, in file order."""
    found: dict[str, list[int]] = {}
    for record in read_raw(world.sessions / "day" / take / "raw.mcap"):
        if isinstance(record, RawFrame):
            found.setdefault(record.boot_id, []).append(record.message.sequence)
    return found


def test_a_frame_kept_for_one_take_never_comes_into_the_next(world: World, camera: Client) -> None:
    """The first take ends, and the next begins, while the frame waits for the engine."""
    world.record()
    world.run(3)
    first = world.take_id
    world.stop()
    world.record()
    message = wire.skeleton_frame(40, world.now_ns, *NOBODY)
    data = wire.encode(message)
    frame = camera_frame("camera_0", "canonical", message)
    world.stage._engine.put(Arrived(frame, data, world.now_ns, camera.hello, first))
    world.run(2)
    world.stop()
    world.end_server()
    assert sequences(world, "take_002") == {"spool-1": [7, 8]}


def test_frames_that_a_stalled_link_held_up_before_the_beginning_are_not_in_the_take(
    world: World, camera: Client
) -> None:
    for _ in range(10):  # on their way since before the beginning
        world.now_ns += 33 * MS
        camera.sequence += 1
        message = wire.skeleton_frame(camera.sequence, world.now_ns, *NOBODY)
        camera._queue.append((camera.sequence, wire.encode(message)))
    world.now_ns += 15 * SECOND
    world.record()
    camera._send_queue()
    world.run(4)
    world.stop()
    world.settle()
    world.end_server()
    assert sequences(world) == {"spool-1": [14, 15, 16, 17]}


def test_a_start_of_another_client_of_the_name_keeps_its_own_channel(world: World, tmp_path: Path) -> None:
    """Two clients of one name take turns: each frame is of the start that took it."""
    one = Client(world, "camera_0", tmp_path / "one")
    two = Client(world, "camera_0", tmp_path / "two")
    one.connect()
    world.record()
    for client in (one, two, one, two):
        for other in (one, two):
            other.disconnect()
        client.connect()
        client.take_frame()
        world.pump()
    world.stop()
    world.end_server()
    assert sequences(world) == {"one-1": [1, 2], "two-1": [1, 2]}


def test_the_file_knows_a_client_and_its_clock_before_the_client_is_told(
    world: World, camera: Client
) -> None:
    world.record()
    state = scan_raw(world.sessions / "day" / "take_001" / "raw.mcap")
    assert ("camera_0", "spool-1") in state.arrived and state.last_event(ClockEvent).clock_id == "spool-1"
    assert state.last_event(JoinedEvent).from_sequence == 4
    camera.start(7 * SECOND)
    camera.connect()
    state = scan_raw(world.sessions / "day" / "take_001" / "raw.mcap")
    assert ("camera_0", "spool-2") in state.arrived and camera.keeper.recording


def test_what_was_taken_after_the_end_was_asked_for_is_not_in_a_take_that_a_kill_left(
    world: World, camera: Client
) -> None:
    """The server is killed while it saves the take: it ends when the operator ended it, not when it was found."""
    world.record()
    world.run(10)
    take_id = world.take_id
    world.kill_server()
    marker = read_marker(world.sessions)
    world.run(5)
    end_ns = world.now_ns
    write_marker(world.sessions, replace(marker, state=STOPPING, server_ns=end_ns))
    world.run(60)
    world.start_server()
    assert world.take_id is None and world.spans[take_id]
    camera.connect()
    world.settle()
    world.end_server()
    frames = sequences(world)["spool-1"]
    assert sorted(frames) == list(range(4, 20))  # one more than 15 lies within what clocks are off
    assert take_info(world.sessions / "day" / "take_001").length_s < 0.6


def test_who_brought_what_after_a_restart_is_told_and_only_that(world: World, camera: Client) -> None:
    world.record()
    world.run(5)
    on_disk = threading.Event()
    world.stage._engine.recording.recorder.when_written(on_disk.set)
    assert on_disk.wait(60)
    world.kill_server()
    world.run(70)
    world.start_server()
    assert "no camera has brought frames of it" in notice(world)
    camera.connect()
    world.settle()
    assert "filled by the cameras, frames: camera_0 70" in notice(world)


def notice(world: World) -> str:
    engine = world.stage._engine
    engine.call(engine._refresh)
    return world.stage.status().recording.notice


def test_another_take_in_the_place_of_the_marked_one_is_left_alone(tmp_path: Path) -> None:
    take = crashed_live_take(tmp_path)
    take.meta["take_id"] = "another"
    take.save_meta()
    content = take.raw_path.read_bytes()
    stage = LiveStage(tmp_path)
    stage.start(prepare=False)
    stage.close()
    assert take.raw_path.read_bytes() == content and "another take" in stage._engine.ended_problem


def test_of_copies_the_one_at_its_own_place_is_the_take(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "day" / "take_001", session="day", name="take_001", source="live")
    take.meta["take_id"] = "0a1b"
    take.save_meta()
    assert find_take(tmp_path, "0a1b") == take.path
    for copy in ("copy", "zz"):
        (tmp_path / "day" / copy).mkdir()
        (tmp_path / "day" / copy / "take.json").write_bytes((take.path / "take.json").read_bytes())
    assert find_take(tmp_path, "0a1b") == take.path
    (take.path / "take.json").unlink()
    assert find_take(tmp_path, "0a1b") is None


def test_reasons(world: World, camera: Client) -> None:
    world.record()
    begin_ns = world.now_ns
    world.run(5)
    world.stop()
    end_ns = world.now_ns - MS
    world.end_server()
    path = world.sessions / "day" / "take_001" / "raw.mcap"
    key = ("camera_0", "spool-1")
    state = scan_raw(path)

    def said(sequence: int, taken_ns: int, who: tuple[str, str] = key) -> str:
        return Membership(state).refusal(who, sequence, taken_ns)

    assert said(9, end_ns) == "" and said(9, end_ns + SECOND) == AFTER
    assert said(3, begin_ns) == BEFORE and said(9, begin_ns - 3 * SECOND) == BEFORE
    assert said(5, end_ns + SECOND) == ""  # a later one came before the end
    assert said(5, begin_ns, ("camera_0", "spool-2")) == STRANGER
    judge = Membership(state)
    assert judge.refusal(key, 20, end_ns + SECOND) == AFTER and judge.refusal(key, 21, begin_ns) == AFTER
    state.events = [(at, event) for at, event in state.events if not isinstance(event, ClockEvent)]
    assert said(9, begin_ns) == UNTIMED and said(5, begin_ns) == ""
    assert inspect_raw(path).duration_s < 1.0


def test_frames_of_a_stranger_are_settled_unsent_while_a_take_is_recorded(
    world: World, camera: Client, tmp_path: Path, caplog
) -> None:
    world.record()
    camera.disconnect()
    stranger = Client(world, "camera_0", tmp_path / "stranger")
    earlier = Origin("day/take_001", world.take_id, hello("camera_0", boot_id="forged"))
    for sequence in range(6):
        data = wire.encode(wire.skeleton_frame(sequence, world.now_ns, *NOBODY))
        stranger.spool.append(earlier, sequence, data)
    stranger.connect()
    world.settle()
    world.stop()
    world.end_server()
    assert "forged" not in sequences(world) and "6 frames of camera_0 were not taken into" in caplog.text

"""A take has the frames of its own cameras from its beginning to its end, all of them, and no others."""

import hashlib
import shutil
import tempfile
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from studio.camera.client.spool import Origin
from studio.take.library.sessions import take_info
from studio.take.raw.frames import RawFrame, inspect_raw, read_raw
from studio.take.raw.membership import BEGIN_NS, END_NS
from tests.live.clients import Client, Frames, World

CAMERAS = 2
SECOND = 1_000_000_000

index = st.integers(0, CAMERAS - 1)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("run"), st.integers(1, 90)),
        st.tuples(st.just("run"), st.integers(1, 20)),
        st.tuples(st.just("record")),
        st.tuples(st.just("stop")),
        st.tuples(st.just("kill")),
        st.tuples(st.just("serve")),
        st.tuples(st.just("cut"), index),
        st.tuples(st.just("connect"), index),
        st.tuples(st.just("reboot"), index, st.integers(-3600, 3600)),
        st.tuples(st.just("play"), index),
        st.tuples(st.just("wait"), st.integers(1, 200)),
    ),
    min_size=4,
    max_size=14,
)


def frames_of(raw: Path) -> Frames:
    found = [(r.camera, r.boot_id, r.message.sequence) for r in read_raw(raw) if isinstance(r, RawFrame)]
    assert len(found) == len(set(found)), "a frame is there twice"
    return set(found)


def do(world: World, cameras: list[Client], players: list[Client], step: tuple) -> None:
    match step:
        case ("run", frames):
            world.run(frames)
        case ("record",):
            world.record()
        case ("stop",):
            world.stop()
        case ("kill",):
            world.kill_server()
        case ("serve",):
            world.start_server()
        case ("cut", k):
            cameras[k].disconnect()
        case ("connect", k):
            players[k].disconnect()
            cameras[k].connect()
        case ("reboot", k, seconds):
            cameras[k].start(seconds * SECOND)
        case ("play", k):
            cameras[k].disconnect()
            players[k].connect()
        case ("wait", seconds):
            world.now_ns += seconds * SECOND


def forged(world: World, take_id: str, name: str, number: int) -> None:
    """A client with a camera's name claims that its frames are of a take, but this start of it took no part in it."""
    client = Client(world, name, world.folder / f"forged_{number}")
    origin = Origin("day/take", take_id, client.hello)
    for _ in range(5):
        world.now_ns += 33_000_000
        client.take_frame()
    for sequence in range(1, 6):
        client.spool.append(origin, sequence, client._queue[sequence - 1][1])
    world.clients.remove(client)
    world.clients.append(client)
    client.connect()
    world.settle()
    client.end()
    world.clients.remove(client)


def deliver(world: World, clients: list[Client]) -> None:
    """Every client connects once and delivers what it owes."""
    for client in clients:
        for other in world.clients:
            other.disconnect()
        client.connect()
        world.settle()
        assert client.keeper.unknown == 0


def check(world: World) -> dict[str, tuple]:
    """Every take has what it should, nothing else; return each take's bytes and lengths."""
    out = {}
    for take_id, (begin_ns, end_ns) in world.spans.items():
        path = world.sessions / "day" / world.paths[take_id]
        frames = frames_of(path / "raw.mcap")
        for frame in frames:
            assert frame[:2] in world.joined[take_id], f"{frame} is of a stranger"
            taken_ns = world.taken_ns[frame]
            assert begin_ns - BEGIN_NS <= taken_ns <= end_ns + END_NS, (
                f"{frame} was not taken within the take"
            )
        owned = {f for f in world.spooled[take_id] if begin_ns <= world.taken_ns[f] <= end_ns}
        assert owned <= frames, (
            f"{len(owned - frames)} frames were lost, such as {sorted(owned - frames)[:3]}"
        )
        length_s = take_info(path).length_s
        assert length_s is None or length_s <= (end_ns - begin_ns) * 1e-9 + 0.01
        duration_s = inspect_raw(path / "raw.mcap").duration_s
        content = [(path / name).read_bytes() for name in ("raw.mcap", "take.json")]
        digest = hashlib.sha256(b"".join(content)).hexdigest()
        out[take_id] = (digest, length_s, duration_s)
    return out


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(steps)
def test_a_take_has_its_own_frames_and_no_others(script: list[tuple]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        world = World(Path(folder))
        try:
            scenario(world, script)
        finally:
            world.end_server()
            for client in world.clients:
                client.end()


def scenario(world: World, script: list[tuple]) -> None:
    cameras = [Client(world, f"camera_{k}", world.folder / f"spool_{k}") for k in range(CAMERAS)]
    players = [Client(world, f"camera_{k}", world.folder / f"player_{k}") for k in range(CAMERAS)]
    for client in cameras:
        client.connect()
    world.run(3)
    for step in script:
        do(world, cameras, players, step)
    world.start_server()
    world.run(5)
    world.stop()
    world.run(40)  # a client whose link is down does not know that the take has ended
    deliver(world, [*cameras, *players])
    world.end_server()
    before = check(world)
    for take_id in list(world.paths)[:1]:  # a copy by hand has the same id
        path = world.sessions / "day" / world.paths[take_id]
        shutil.copytree(path, path.with_name("copy"))
    world.start_server()
    for number, take_id in enumerate(world.spans):
        forged(world, take_id, f"camera_{number % CAMERAS}", number)
    for client in players:
        client.connect()
    world.run(30)
    world.end_server()
    assert check(world) == before, "a take that had ended was changed"

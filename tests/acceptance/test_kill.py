"""kill -9 of the server, and of clients, in the middle of takes: nothing is lost, and the take goes on."""

import random
import time
from pathlib import Path

import pytest

from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.offline.replay import solve_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawEvent, RawFrame, inspect_raw, read_raw
from studio.take.raw.live_log import RestartEvent, StoppedEvent
from studio.take.upkeep.doctor import check_takes
from tests.acceptance.processes import (
    CameraProcess,
    ServerProcess,
    camera_processes,
    check_nothing_lost,
    sequences,
    server_process,
    wait_until,
)

CAMERAS = 2
ON_DISK_S = 0.5


def age_of_newest_ns(raw: Path, killed_ns: int) -> int:
    """How old the newest frame on disk was when the server was killed [ns]."""
    return killed_ns - max((r.arrival_ns for r in read_raw(raw) if isinstance(r, RawFrame)), default=0)


def kill_within_take(server: ServerProcess, name: str, seconds: float) -> tuple[Path, float]:
    """Record, kill, start again, let the clients fill the gap, stop; return the take and what was missing [s]."""
    path = server.record(name)
    time.sleep(seconds)
    killed_ns = server.kill()
    missing_s = age_of_newest_ns(path / "raw.mcap", killed_ns) * 1e-9 if seconds > 0.5 else 0.0
    server.start()
    goes_on_whole(server, name)
    assert server.stop()["problem"] == ""
    return path, missing_s


def goes_on_whole(server: ServerProcess, name: str) -> None:
    """Wait until the cameras are back in a take that a start found, and have filled its gap."""
    recording = server.status()["recording"]
    assert recording["active"] and recording["take"] == name and len(recording["restarts"]) == 1
    wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras are back")
    wait_until(lambda: not server.status()["recording"]["missing_frames"], "the gap is filled")
    assert "filled by the cameras" in server.status()["recording"]["notice"]


def check_settled(server: ServerProcess, path: Path) -> None:
    """Nothing is owed, nothing is lost, and the take is closed."""
    wait_until(lambda: server.kept() == 0, "nothing is owed")
    assert check_nothing_lost(path / "raw.mcap") > 0 and inspect_raw(path / "raw.mcap").complete
    assert Take.open(path).meta["recording"] == "done"


def check_spools(cameras: list[CameraProcess]) -> None:
    """The cameras let go of what was delivered."""
    wait_until(lambda: not any(list(camera.spool.glob("*.spool"))[1:] for camera in cameras), "no old spool")


def check_healthy(sessions: Path) -> None:
    """No file of a take is damaged; the end of one that was being written may be torn."""
    assert [f for f in check_takes(sessions) if "torn" not in f.problem] == []


def run_kills(tmp_path: Path, count: int, longest_s: float) -> list[float]:
    """Kill and start again so often; return how much was not on the disk each time [s]."""
    rng = random.Random(5)
    missing_s: list[float] = []
    with (
        server_process(tmp_path / "sessions") as server,
        camera_processes(tmp_path, server.url, CAMERAS) as cameras,
    ):
        wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras send")
        for k in range(count):
            path, seconds = kill_within_take(server, f"take_{k}", rng.uniform(0.0, longest_s))
            missing_s.append(seconds)
            check_settled(server, path)
        check_spools(cameras)
    print(
        f"{count} kills; seconds that were not on the disk: {', '.join(f'{s:.3f}' for s in sorted(missing_s))}"
    )
    check_healthy(tmp_path / "sessions")
    return missing_s


@pytest.mark.long
@pytest.mark.timeout(5400)
def test_kill_at_50_random_moments(tmp_path: Path) -> None:
    assert max(run_kills(tmp_path, 50, 4.0)) <= ON_DISK_S


@pytest.mark.timeout(900)
def test_a_killed_client_delivers_with_its_next_start_and_as_live_is_equal(tmp_path: Path) -> None:
    """The server and a client are killed at once: the client's next start brings what the first one kept."""
    with (
        server_process(tmp_path / "sessions") as server,
        camera_processes(tmp_path, server.url, CAMERAS) as cameras,
    ):
        wait_until(lambda: server.live_cameras() == CAMERAS, "the cameras send")
        wait_until(lambda: server.status()["pipeline"]["rate_hz"] > 1, "poses come")
        path = server.record("both")
        time.sleep(1.5)
        server.kill()
        before = sequences(path / "raw.mcap")
        time.sleep(1.0)
        cameras[0].kill()
        cameras[0].start()
        server.start()
        goes_on_whole(server, "both")
        wait_until(lambda: server.status()["pipeline"]["rate_hz"] > 1, "poses come again")
        stopped = server.stop()
        assert stopped["poses"] > 0 and stopped["problem"] == ""
        check_settled(server, path)
        check_spools(cameras)
    raw = path / "raw.mcap"
    after = sequences(raw)
    assert len([key for key in after if key[0] == "camera_0"]) == 2
    (first,) = (key for key in before if key[0] == "camera_0")
    assert max(after[first]) >= max(before[first]) + 5  # what it took while the server was away
    kinds = [type(r.event) for r in read_raw(raw) if isinstance(r, RawEvent)]
    assert kinds.count(RestartEvent) == 1 and kinds.count(StoppedEvent) == 1
    check_healthy(tmp_path / "sessions")
    take = Take.open(path)
    solve_take(take, preset("studio"), name="again", as_live=True)
    live, again = (Poses.load(take.solve_folder(name) / "poses.npz") for name in ("live", "again"))
    assert live.time_s.tobytes() == again.time_s.tobytes()
    assert live.positions_m.tobytes() == again.positions_m.tobytes()
    assert live.rotations_wxyz.tobytes() == again.rotations_wxyz.tobytes()

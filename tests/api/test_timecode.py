"""Timecode through the server: it comes in over a socket, and is recorded with the take on the stage clock."""

import shutil
import socket
import time

import numpy as np
import pytest

from studio.engine.model.poses import Poses
from studio.engine.timecode.timecode import RATES, Timecode
from studio.take.folder.take import Take
from studio.take.timecode.kept import FILE, take_course
from tests.api.camera import wait_until
from tests.api.test_recording import cameras, record, studio  # noqa: F401
from tests.timecode.test_incoming import Sender

RATE = RATES["25"]


@pytest.fixture
def art_net(studio):  # noqa: F811
    """A desk that sends Art-Net timecode to the server; its first frame, and what it sends instead from now on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    answer = studio.http.put("/timecode", json={"source": f"artnet:127.0.0.1:{port}", "rate": "25"})
    assert answer.status_code == 200 and answer.json()["rate"] == "25", answer.text
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    desk = {"first": Timecode.parse("09:59:59:00", RATE).frame, "silent": False, "jump": 0}

    def send(frame):
        h, m, s, f = Timecode(frame + desk["jump"], RATE).parts
        if not desk["silent"]:
            channel.sendto(
                b"Art-Net\x00\x00\x97\x00\x0e\x00\x00" + bytes([f, s, m, h, 1]), ("127.0.0.1", port)
            )

    sender = Sender(RATE, desk["first"], 1, send)
    wait_until(lambda: studio.http.get("/status").json()["timecode"]["state"] == "running", "timecode runs")
    yield desk
    sender.close()
    channel.close()


def test_a_take_has_the_timecode_that_came_in(studio, cameras, art_net):  # noqa: F811
    def lose():
        art_net["silent"] = True

    def jump():
        art_net.update(silent=False, jump=250_000)
        time.sleep(0.5)

    take, _ = record(studio, cameras, lambda: None, lose, jump)
    poses = Poses.load(take.solve_folder("live") / "poses.npz")
    path = take_course(take, poses.begins_s)
    assert path.rate is RATE and path.source == "artnet" and take.meta["timecode_rate"] == "25"
    assert len(path.runs) == 2 and len(path.jumps()) == 1
    assert path.bridged_at(poses.time_s).any() and not path.bridged_at(poses.time_s).all()
    frames = path.frames_at(poses.time_s)
    steps = np.diff(frames)
    jumped = np.abs(steps) > 100
    assert jumped.sum() == 1
    # the sender is late by as much as the machine is busy
    np.testing.assert_allclose(steps[~jumped], np.diff(poses.time_s)[~jumped] * RATE.fps, atol=1.0)
    told = studio.http.get(f"/takes/tests/{take.path.name}").json()["timecode"]
    assert (told["rate"], told["source"], told["count"]) == ("25", "artnet", 25)
    assert len(told["runs"]) == 2 and len(told["bridged_s"]) >= 1
    # the stage clock is that of camera_0, which is the server's in this test
    last = studio.stage.results.get()[1]
    assert last.timecode is not None

    kept = path.frames_at(poses.time_s)
    (take.path / FILE).unlink()
    from_log = take_course(Take.open(take.path), poses.begins_s)
    np.testing.assert_allclose(from_log.frames_at(poses.time_s), kept, atol=0.1)


def test_a_take_without_timecode_has_the_time_of_day(studio, cameras):  # noqa: F811
    take, _ = record(studio, cameras, lambda: None)
    assert not (take.path / FILE).exists() and "timecode_rate" not in take.meta
    poses = Poses.load(take.solve_folder("live") / "poses.npz")
    path = take_course(take, poses.begins_s)
    assert str(path.timecodes_at(poses.time_s[:1])[0]) == take.meta["timecode"]
    assert not path.bridged_at(poses.time_s).any()


def test_a_damaged_file_says_so(studio, cameras, art_net):  # noqa: F811
    take, _ = record(studio, cameras, lambda: None)
    (take.path / FILE).write_bytes(b"PK no")
    with pytest.raises(Exception, match="is damaged"):
        take_course(take, 0.0)
    shutil.rmtree(take.path)


def test_what_is_not_allowed(studio):  # noqa: F811
    for request in ({"source": "vitc", "rate": "25"}, {"source": "clock", "rate": "26"}):
        answer = studio.http.put("/timecode", json=request)
        assert answer.status_code == 422 and "allowed" in answer.json()["error"]["message"]
    assert studio.http.get("/status").json()["timecode"]["source"] == "off"

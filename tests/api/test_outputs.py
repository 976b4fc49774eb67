"""Live output over the API: targets that get datagrams, and the WebSocket stream, from a real server."""

import json
import socket

import httpx
import pytest
from websockets.exceptions import InvalidStatus

from tests.api.camera import Camera, send_frames, wait_until
from tests.live.performer import save_stage_calibration
from tests.patient import connect


@pytest.fixture
def receiver():
    """A UDP socket on a free port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        opened.settimeout(30.0)
        yield opened


def perform(studio, count: int = 40) -> None:
    """Let a camera see the performer for so many frames."""
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.exchange_clocks()
        send_frames([camera], count)


@pytest.fixture
def calibrated(start_studio, tmp_path):
    save_stage_calibration(tmp_path / "sessions", ["camera_0"])
    return start_studio(tmp_path / "sessions")


def test_a_target_gets_the_live_motion_and_is_kept(calibrated, start_studio, receiver, tmp_path):
    port = receiver.getsockname()[1]
    made = calibrated.http.post("/outputs", json={"kind": "vmc", "port": port, "rate_hz": 30})
    assert made.status_code == 201, made.text
    name = made.json()["id"]
    perform(calibrated)
    assert receiver.recv(4096).startswith(b"#bundle")
    wait_until(lambda: calibrated.http.get("/outputs").json()["outputs"][0]["sent"] > 0, "frames are counted")
    off = calibrated.http.patch(f"/outputs/{name}", json={"enabled": False}).json()
    assert not off["enabled"] and off["port"] == port
    again = start_studio(tmp_path / "sessions").http.get("/outputs").json()["outputs"]
    assert [(target["id"], target["enabled"]) for target in again] == [(name, False)]
    assert calibrated.http.delete(f"/outputs/{name}").status_code == 200
    assert calibrated.http.get("/outputs").json()["outputs"] == []


@pytest.mark.parametrize(
    "wrong",
    [{"kind": "fax"}, {"kind": "vmc", "port": 70000}, {"kind": "vmc", "host": "a b"}, {"kind": "vmc", "host": ""},
     {"kind": "rokoko", "rate_hz": 0}, {"kind": "vmc", "scale": -1}, {"kind": "rokoko", "actor": ""}],
)  # fmt: skip
def test_wrong_values_are_refused(studio, wrong):
    answer = studio.http.post("/outputs", json=wrong)
    assert answer.status_code == 422 and answer.json()["error"]["message"]
    assert studio.http.get("/outputs").json()["outputs"] == []


def test_an_unknown_target_is_not_found(studio):
    assert studio.http.patch("/outputs/nothing", json={"enabled": True}).status_code == 404
    assert studio.http.delete("/outputs/nothing").status_code == 404


def test_a_receiver_that_does_not_exist_is_told_and_the_others_go_on(calibrated, receiver):
    port = receiver.getsockname()[1]
    lost: httpx.Response = calibrated.http.post(
        "/outputs", json={"kind": "vmc", "host": "no-such-machine.invalid"}
    )
    calibrated.http.post("/outputs", json={"kind": "rokoko", "port": port})
    perform(calibrated)
    assert receiver.recv(65536)

    def problem() -> str:
        targets = {target["id"]: target for target in calibrated.http.get("/outputs").json()["outputs"]}
        return targets[lost.json()["id"]]["problem"]

    wait_until(lambda: "no-such-machine.invalid" in problem(), "the problem is told")


def test_a_damaged_file_is_told_and_left(start_studio, tmp_path):
    (tmp_path / "sessions").mkdir()
    (tmp_path / "sessions/outputs.json").write_text("{broken")
    studio = start_studio(tmp_path / "sessions")
    assert "outputs.json" in studio.http.get("/outputs").json()["problem"]
    assert (tmp_path / "sessions/outputs.json").read_text() == "{broken"


def test_the_stream_begins_with_the_skeleton_and_brings_frames(calibrated):
    with connect(calibrated.url("stream?rate_hz=30")) as stream:
        head = json.loads(stream.recv(timeout=60))
        assert head["type"] == "skeleton" and len(head["joint_names"]) == 52
        perform(calibrated)
        times = []
        for _ in range(5):
            frame = json.loads(stream.recv(timeout=60))
            assert len(frame["positions_m"]) == len(frame["rotations_wxyz"]) == 52
            times.append(frame["time_s"])
        assert times == sorted(set(times))


def test_a_stream_of_a_wrong_rate_is_refused(studio):
    with pytest.raises(InvalidStatus):
        connect(studio.url("stream?rate_hz=1000"))

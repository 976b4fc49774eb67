"""Joint targets of a robot, from a real server to a receiver in a process of its own, and over the WebSocket."""

import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosedError

from studio import wire
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.robots.files import FOLDER, add_robot
from tests.api.camera import Camera, send_frames
from tests.engine.robots import models
from tests.live.performer import save_stage_calibration
from tests.patient import connect

RECEIVER = """
import json, socket
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(60.0)
    print(receiver.getsockname()[1], flush=True)
    held = 0
    while held < 30:
        text = receiver.recv(65536).decode()
        message = json.loads(text)
        held += message.get("state") == "hold"
        print(text, flush=True)
"""


@pytest.fixture
def studio_with_robot(start_studio, tmp_path: Path):
    save_stage_calibration(tmp_path / "sessions", ["camera_0"])
    model = models.written(tmp_path, models.child())
    add_robot(tmp_path / "sessions" / FOLDER, model, "child")
    return start_studio(tmp_path / "sessions")


def perform_and_leave(studio, done: threading.Event) -> None:
    """Let a camera see the performer for 60 frames, and nobody from then on."""
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.exchange_clocks()
        send_frames([camera], 60)
        while not done.is_set():
            camera.sequence += 1
            nobody = np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT)
            camera.send(wire.skeleton_frame(camera.sequence, camera.clock_ns(), *nobody))
            time.sleep(1.0 / 30.0)


def test_a_robot_follows_within_its_limits_and_holds_when_the_performer_is_lost(studio_with_robot):
    with subprocess.Popen([sys.executable, "-c", RECEIVER], stdout=subprocess.PIPE, text=True) as receiver:
        assert receiver.stdout is not None
        port = int(receiver.stdout.readline())
        made = studio_with_robot.http.post(
            "/outputs", json={"kind": "robot", "robot": "child", "port": port, "rate_hz": 100}
        )
        assert made.status_code == 201, made.text
        url = studio_with_robot.url("stream?robot=child&rate_hz=50")
        with connect(url) as socket:
            assert json.loads(socket.recv())["type"] == "robot"
            assert json.loads(socket.recv())["state"] == "wait"
        done = threading.Event()
        cameras = threading.Thread(target=perform_and_leave, args=(studio_with_robot, done))
        cameras.start()
        try:
            told = [json.loads(line) for line in receiver.stdout]
        finally:
            done.set()
            cameras.join()
    head = told[0]
    frames = [message for message in told if message["type"] == "joint_targets"]
    states = [message["state"] for message in frames]
    assert head["type"] == "robot" and len(head["joint_names"]) == 25
    assert states == sorted(states, key=["wait", "follow", "hold"].index)
    assert states.count("follow") > 10
    numbers = [message["sequence"] for message in frames]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    joints = np.array([message["joints_rad"] for message in frames])
    low, high, speed = (np.array(head[key]) for key in ("low_rad", "high_rad", "velocity_rad_s"))
    assert (joints >= low - 1e-5).all() and (joints <= high + 1e-5).all()
    assert (np.abs(np.diff(joints, axis=0)) <= speed / 100 + 1e-5).all()
    assert np.ptp(joints, axis=0).max() > 0.1, "it moves"
    assert np.abs(joints[-1] - joints[-2]).max() < 1e-4, "and comes to rest"


def test_what_a_robot_needs_is_told(studio_with_robot):
    post = studio_with_robot.http.post
    assert post("/outputs", json={"kind": "robot"}).status_code == 422
    for rate_hz in (30, 120):
        refused = post("/outputs", json={"kind": "robot", "robot": "child", "rate_hz": rate_hz})
        assert refused.status_code == 422 and "50 to 100" in refused.text
    assert "no robot 'nobody'" in post("/outputs", json={"kind": "robot", "robot": "nobody"}).text
    for wrong in ("robot=nobody", "robot=child&rate_hz=30"):
        with connect(studio_with_robot.url(f"stream?{wrong}")) as socket:
            with pytest.raises(ConnectionClosedError) as closed:
                socket.recv()
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 4422

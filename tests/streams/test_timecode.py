"""Timecode in live output, as receivers hear it."""

import json
import socket
from dataclasses import replace

import numpy as np
import pytest
from pythonosc.osc_packet import OscPacket

from studio.engine.timecode.timecode import RATES, Timecode
from studio.streams.cast import Member
from studio.streams.frames import frame_message
from studio.streams.sender import Sender
from studio.streams.targets import Target
from tests.poses_factory import random_poses
from tests.streams.steps import step
from tests.streams.test_rokoko import received

TIMECODE = Timecode.parse("10:00:59;29", RATES["29.97df"])


@pytest.fixture
def timed():
    return replace(step(random_poses(np.random.default_rng(1), seconds=0.5), 3), timecode=TIMECODE)


@pytest.mark.parametrize("kind", ["vmc", "rokoko"])
def test_a_receiver_hears_it(timed, kind):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(60.0)
        sender = Sender(Target("x", kind, port=receiver.getsockname()[1]), lambda: {1: Member("", None)})
        sender.add(timed)
        data = receiver.recv(65536)
        sender.close()
    if kind == "vmc":
        (message,) = OscPacket(data).messages
        assert (message.message.address, message.message.params) == (
            "/studio/timecode", ["10:00:59;29", "29.97df"]
        )  # fmt: skip
    else:
        scene = received(data)["scene"]
        assert (scene["timecode"], scene["timecodeRate"]) == ("10:00:59;29", "29.97df")


def test_the_web_socket_stream(timed):
    frame = json.loads(frame_message([(timed, Member("", None))]))
    assert (frame["timecode"], frame["timecode_rate"]) == ("10:00:59;29", "29.97df")
    assert "timecode" not in json.loads(frame_message([(replace(timed, timecode=None), Member("", None))]))

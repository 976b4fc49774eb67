"""Live output of several performers: a target for each, or all in one; heard by plain sockets."""

import json
import socket
from dataclasses import replace

import lz4.frame
import pytest

from studio.engine.base.sentences import Said
from studio.engine.model.frames import StepResult
from studio.streams import Member, Target, steps_of
from studio.streams.frames import frame_message
from studio.streams.sender import Sender
from tests.streams.steps import step

CAST = {1: Member("Ada", None), 2: Member("Bo", None)}


@pytest.fixture
def both(motion) -> StepResult:
    """A step of two performers."""
    second = replace(step(motion, 20), performer=2, frame_set=step(motion, 3).frame_set)
    return replace(step(motion, 3), others=(second,))


@pytest.fixture
def receiver():
    """A socket on the loopback."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as heard:
        heard.bind(("127.0.0.1", 0))
        heard.settimeout(60.0)
        yield heard


def send(result: StepResult, receiver: socket.socket, kind: str, performer: str) -> Sender:
    target = Target("a", kind, port=receiver.getsockname()[1], performer=performer)
    sender = Sender(target, lambda: CAST)
    sender.add(result)
    return sender


def actors(receiver: socket.socket) -> dict[str, float]:
    """The actors of the next datagram with the height of their hips."""
    scene = json.loads(lz4.frame.decompress(receiver.recv(65535)))["scene"]
    return {actor["name"]: actor["body"]["hip"]["position"]["y"] for actor in scene["actors"]}


def test_one_target_has_room_for_all_actors(both, receiver):
    send(both, receiver, "rokoko", "").close()
    expected = {name: one.positions_m[0, 2] for name, one in zip(("Ada", "Bo"), both.each(), strict=True)}
    assert actors(receiver) == pytest.approx(expected, abs=1e-4)


def test_a_target_of_a_name_gets_that_performer_alone(both, receiver):
    send(both, receiver, "rokoko", "Bo").close()
    assert [*actors(receiver).values()] == pytest.approx([both.others[0].positions_m[0, 2]], abs=1e-4)


def test_vmc_of_each_performer_differs(both, receiver):
    heard = []
    for name in ("Ada", "Bo"):
        send(both, receiver, "vmc", name).close()
        heard.append(receiver.recv(65535))
        receiver.setblocking(False)
        while True:
            try:
                receiver.recv(65535)
            except BlockingIOError:
                break
        receiver.settimeout(60.0)
    assert heard[0] != heard[1]


def test_nobody_of_that_name_is_told_and_nothing_is_sent(both, receiver):
    sender = send(both, receiver, "vmc", "Cy")
    sender.close()
    status = sender.status()
    assert (status.sent, status.bytes) == (0, 0)
    assert isinstance(status.problem, Said) and status.problem.code == "output.nobody"


def test_the_websocket_names_each_and_one_alone_has_no_name(both):
    message = json.loads(frame_message(steps_of(both, CAST, "")))
    assert (message["performer"], [one["performer"] for one in message["others"]]) == ("Ada", ["Bo"])
    only = json.loads(frame_message(steps_of(both, CAST, "Bo")))
    assert only["performer"] == "Bo" and "others" not in only
    assert only["positions_m"] == message["others"][0]["positions_m"]
    alone = json.loads(frame_message(steps_of(replace(both, others=()), {1: Member("", None)}, "")))
    assert [*alone] == ["type", "time_s", "positions_m", "rotations_wxyz", "confidence"]

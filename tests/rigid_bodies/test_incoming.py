"""Where rigid bodies are at a time, also when it is asked late."""

import itertools
import socket

import numpy as np
import pytest

from studio.engine.rigid_bodies.known import KnownBody, Tie
from studio.rigid_bodies.incoming import IncomingBodies
from studio.rigid_bodies.settings import RigidSettings
from tests.api.camera import wait_until
from tests.rigid_bodies.test_packets import message

STEP_NS, COUNT, BATCH = 4_000_000, 250, 50


@pytest.fixture
def late(tmp_path):
    """A tracker that moved along x by 1 m a second for a second, one packet each 4 ms of a clock of its own."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    clock, heard = itertools.count(STEP_NS, STEP_NS), []
    bodies = IncomingBodies(tmp_path, lambda: next(clock))
    bodies.on_heard = lambda time_ns, axes, told: heard.append(time_ns)
    known = KnownBody("tracker 1", use="evidence", joint="head")
    ties = {"tracker 1": Tie((0.0, 0.0, 0.1), 1.0)}
    bodies.change(RigidSettings(osc=True, osc_port=port, bodies=(known,), ties=ties))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(1, COUNT + 1):
            place = message("/tracking/trackers/1/position", number * STEP_NS * 1e-9, 1.5, 0.0).build().dgram
            sender.sendto(place, ("127.0.0.1", port))
            if number % BATCH == 0:
                wait_until(lambda: len(heard) == number, "all are heard")  # noqa: B023
    yield bodies, COUNT * STEP_NS
    bodies.close()


def test_an_instant_that_passed_has_its_own_place(late):
    """An engine that is late asks for instants since which hundreds of readings have come."""
    bodies, end_ns = late
    for ago_ns in (-140_000_000, 0, 30_000_000, 400_000_000, 900_000_000):
        told = bodies.evidence_at(end_ns - ago_ns)
        expected_m = (end_ns - max(ago_ns, 0)) * 1e-9
        np.testing.assert_allclose(told["performer_1"]["head"], [-expected_m, 0.0, 1.6], atol=2e-5)
    assert bodies.evidence_at(end_ns + 160_000_000) == {}
    assert bodies.evidence_at(-160_000_000) == {}

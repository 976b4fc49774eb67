"""A performer, its body and what it does, made once."""

import pytest

from studio.camera.simulator.depth.body import make_body
from studio.camera.simulator.depth.motion import perform
from studio.camera.simulator.depth.performers import DEFAULT
from studio.camera.simulator.depth.proportions import performer_offsets
from studio.engine.motion.authored import demo_motion


@pytest.fixture(scope="session")
def body():
    return make_body(DEFAULT, performer_offsets(DEFAULT))


@pytest.fixture(scope="session")
def performance():
    return perform(demo_motion(), DEFAULT)

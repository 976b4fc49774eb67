"""Fixtures that are made once: a performer, its body and its performance."""

import pytest

from studio.engine.animation.motion.authored import demo_motion
from studio.simulator.body.mesh import make_body
from studio.simulator.body.performers import DEFAULT
from studio.simulator.body.proportions import performer_offsets
from studio.simulator.performer.motion import perform


@pytest.fixture(scope="session")
def body():
    return make_body(DEFAULT, performer_offsets(DEFAULT))


@pytest.fixture(scope="session")
def performance():
    return perform(demo_motion(), DEFAULT)

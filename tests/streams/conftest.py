import numpy as np
import pytest

from tests import poses_factory


@pytest.fixture
def t_pose():
    """One frame in the T-pose."""
    return poses_factory.t_pose()


@pytest.fixture
def motion():
    """Half a second of smooth random motion at 60 Hz."""
    return poses_factory.random_poses(np.random.default_rng(0), seconds=0.5)

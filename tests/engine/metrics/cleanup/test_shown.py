"""The animation as it is played: the poses at its keys, and between them the motion that the keys were made from."""

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.metrics.cleanup import shown_animation
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from tests.poses_factory import random_poses, t_pose


@pytest.mark.parametrize("hz", [30.0, 60.0, 120.0])
def test_at_its_keys_it_is_the_solve(hz):
    poses = random_poses(np.random.default_rng(3), seconds=2.0, hz=hz)
    shown = shown_animation(poses)
    assert np.abs(shown.time_s[::2] - poses.time_s).max() < 1e-9
    expected = poses.positions_m[:, OUTPUT_OF_CANONICAL_INDEX]
    assert np.abs(shown.positions_m[::2] - expected).max() < 1e-6
    assert np.abs(shown.rotations @ shown.rotations.transpose(0, 1, 3, 2) - np.eye(3)).max() < 1e-9


def test_between_its_keys_it_follows_the_motion():
    """A motion at 120 Hz, exported at 60 Hz, is within a millimetre of the frames that were left out."""
    fine = random_poses(np.random.default_rng(5), seconds=2.0, hz=120.0)
    coarse = random_poses(np.random.default_rng(5), seconds=2.0, hz=60.0)
    shown = shown_animation(coarse)
    count = min(len(shown.time_s), len(fine.time_s))
    expected = fine.positions_m[:count, OUTPUT_OF_CANONICAL_INDEX]
    assert np.linalg.norm(shown.positions_m[:count] - expected, axis=2).max() < 1e-3


def test_the_rest_pose_stands_on_the_floor():
    rest = shown_animation(t_pose(5)).rest_m
    assert rest[:, 2].min() == pytest.approx(0.02, abs=1e-9)
    assert rest[:, 2].max() > 1.2


def test_poses_without_a_frame_are_refused():
    with pytest.raises(FormatError):
        shown_animation(t_pose(0))

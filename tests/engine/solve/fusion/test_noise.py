"""The noise of a camera's joint: along its ray, across it, by distance, joint and confidence."""

import numpy as np
import pytest

from studio.engine.model.cameras.joint_noise import covariances
from studio.engine.model.joints import INDEX, JOINT_COUNT


def at_distance(distance_m, confidence=0.9):
    """Covariances of joints straight ahead (+y) of a camera at (1, 2, 3)."""
    camera = np.array([[1.0, 2.0, 3.0]])
    positions = np.tile(camera + np.array([0.0, distance_m, 0.0]), (JOINT_COUNT, 1))[None]
    return covariances(positions, np.full((1, JOINT_COUNT), confidence), camera)[0]


def test_covariances_are_symmetric_and_positive():
    rng = np.random.default_rng(1)
    positions = rng.normal(0, 3, (3, JOINT_COUNT, 3))
    found = covariances(positions, rng.uniform(0, 1, (3, JOINT_COUNT)), rng.normal(0, 1, (3, 3)))
    assert np.allclose(found, found.swapaxes(-1, -2))
    assert np.linalg.eigvalsh(found).min() > 0


def test_depth_noise_grows_with_the_square_of_the_distance_and_is_along_the_ray():
    near, far = at_distance(2.0)[INDEX["left_elbow"]], at_distance(4.0)[INDEX["left_elbow"]]
    assert np.sqrt(far[1, 1] / near[1, 1]) == pytest.approx(4.0)
    assert np.sqrt(far[0, 0] / near[0, 0]) == pytest.approx(2.0)
    assert np.abs(near - np.diag(np.diag(near))).max() < 1e-12
    assert far[1, 1] > far[0, 0], "far away, depth is the worse"


def test_limb_ends_and_unsure_joints_are_noisier():
    sure = np.trace(at_distance(3.0), axis1=1, axis2=2)
    assert (
        sure[INDEX["hips"]] < sure[INDEX["left_elbow"]] < sure[INDEX["left_wrist"]] < sure[INDEX["left_hand"]]
    )
    unsure = np.trace(at_distance(3.0, 0.4), axis1=1, axis2=2)
    assert (unsure > 3 * sure).all()


def test_a_joint_in_the_lens_is_finite():
    assert np.isfinite(at_distance(0.0)).all() and (np.diagonal(at_distance(0.0), axis1=1, axis2=2) > 0).all()

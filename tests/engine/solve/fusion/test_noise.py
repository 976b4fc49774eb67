"""The noise of a camera's joint: along its ray, across it, by distance, joint and confidence."""

import numpy as np
import pytest

from studio.engine.model.cameras.joint_noise import LANDMARK_M, covariances, variances
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.triangulation.rays import FREE_M


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


def test_errors_of_landmarks_are_as_large_far_away():
    centres = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    near, far = (
        variances(
            np.tile([0.0, metres, 0.0], (2, JOINT_COUNT, 1)),
            np.ones((2, JOINT_COUNT)),
            centres,
            np.array([FREE_M, np.nan]),
        )
        for metres in (2.0, 6.0)
    )
    elbow = INDEX["left_elbow"]
    np.testing.assert_allclose(near[2][0], far[2][0])
    assert np.sqrt(far[2][0, elbow]) == pytest.approx(LANDMARK_M)
    assert far[2][1, elbow] > 5 * near[2][1, elbow], "those of a depth camera grow"


def test_limb_ends_are_as_sure_as_elbows_in_pictures_but_for_toes():
    lateral = variances(
        np.tile([0.0, 3.0, 0.0], (1, JOINT_COUNT, 1)),
        np.ones((1, JOINT_COUNT)),
        np.zeros((1, 3)),
        np.array([FREE_M]),
    )[2][0]
    names = ("elbow", "wrist", "hand", "ankle", "hip", "toe")
    errors = [np.sqrt(lateral[INDEX[f"left_{name}"]]) / LANDMARK_M for name in names]
    np.testing.assert_allclose(errors, [1.0, 1.0, 1.0, 1.0, 1.25, 1.5])
    assert np.sqrt(lateral[INDEX["hips"]]) == pytest.approx(4 * LANDMARK_M), "no landmark shows them"

"""Rigid transforms and rotations: properties over random input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import (
    fit_rigid,
    invert_transform,
    is_rigid,
    make_transform,
    matrices,
    quaternions,
    rotation_between,
    transform_points,
)

quickly = settings(deadline=None, max_examples=60)
seeds = st.integers(0, 2**32 - 1)
vectors = arrays(np.float64, 3, elements=st.floats(-100, 100))


def random_transform(rng, *, reach_m=5.0):
    return make_transform(
        Rotation.random(random_state=int(rng.integers(2**31))).as_matrix(), rng.uniform(-reach_m, reach_m, 3)
    )


@quickly
@given(seeds, st.integers(4, 40))
def test_fit_rigid_recovers_a_transform(seed, count):
    rng = np.random.default_rng(seed)
    T, points = random_transform(rng), rng.normal(0, 1, (count, 3))
    found = fit_rigid(points, transform_points(T, points), rng.uniform(0.1, 1, count))
    assert np.abs(found - T).max() < 1e-7


@quickly
@given(seeds)
def test_fit_rigid_never_mirrors(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 1, (12, 3)) * rng.choice([1.0, 1e-9], 3)  # flat and thin clouds too
    target = rng.choice([points * [-1, 1, 1], rng.normal(0, 1, points.shape), points * 0.0])
    T = fit_rigid(points, target)
    assert is_rigid(T) and np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


def test_fit_rigid_leaves_out_points_of_no_weight():
    rng = np.random.default_rng(1)
    T, points = random_transform(rng), rng.normal(0, 1, (10, 3))
    target = transform_points(T, points)
    target[3] += 7.0
    weights = np.ones(10)
    weights[3] = 0.0
    assert np.allclose(fit_rigid(points, target, weights), T)
    assert not np.allclose(fit_rigid(points, target), T, atol=1e-3)


@quickly
@given(seeds)
def test_a_transform_and_its_inverse_cancel(seed):
    rng = np.random.default_rng(seed)
    T, points = random_transform(rng), rng.normal(0, 3, (2, 5, 3))
    assert np.allclose(invert_transform(T) @ T, np.eye(4))
    assert np.allclose(transform_points(invert_transform(T), transform_points(T, points)), points)
    assert is_rigid(T)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda T: T * [[-1], [1], [1], [1]],
        lambda T: T * 1.1,
        lambda T: T[:3],
        lambda T: T + np.eye(4) * np.nan,
        lambda T: np.vstack([T[:3], [0, 0, 0.1, 1]]),
        lambda T: np.where(np.eye(4, k=3) > 0, np.inf, T),
        lambda T: T + 0.01 * np.eye(4, k=1),
    ],
    ids=["mirrored", "scaled", "3x4", "nan", "last row", "inf", "sheared"],
)
def test_what_is_not_rigid(spoil):
    assert not is_rigid(spoil(random_transform(np.random.default_rng(2))))


@quickly
@given(seeds)
def test_quaternions_and_matrices_round_trip(seed):
    q = Rotation.random(6, random_state=seed % 2**32).as_quat(scalar_first=True).reshape(2, 3, 4)
    m = matrices(q)
    assert m.shape == (2, 3, 3, 3)
    back = quaternions(m)
    assert (back[..., 0] >= 0).all()
    assert np.abs(np.abs((back * q).sum(-1)) - 1).max() < 1e-12
    assert np.abs(matrices(back) - m).max() < 1e-12


def test_quaternions_are_wxyz():
    quarter_about_z = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert quaternions(quarter_about_z) == pytest.approx([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    assert np.allclose(matrices(np.array([1.0, 0, 0, 0])), np.eye(3))


def assert_turns(rotation, a, b):
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-9
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    cosine = (rotation @ a) @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    assert cosine == pytest.approx(1.0, abs=1e-9)


@quickly
@given(vectors, vectors)
def test_rotation_between_turns_a_to_b_without_twist(a, b):
    if np.linalg.norm(a) < 1e-3 or np.linalg.norm(b) < 1e-3:
        return
    rotation = rotation_between(a, b)
    assert_turns(rotation, a, b)
    axis = np.cross(a, b)
    if np.linalg.norm(axis) > 1e-3 * np.linalg.norm(a) * np.linalg.norm(b):
        assert np.allclose(rotation @ axis, axis, atol=1e-7 * np.linalg.norm(axis))


@quickly
@given(seeds, st.floats(-12, 0))
def test_rotation_between_near_opposites(seed, exponent):
    rng = np.random.default_rng(seed)
    a = rng.normal(size=3)
    assert_turns(rotation_between(a, -a), a, -a)
    almost = -a + 10.0**exponent * rng.normal(size=3)
    assert_turns(rotation_between(a, almost), a, almost)


def test_rotation_between_of_no_direction_is_no_turn():
    a = np.array([0.0, 0, 1])
    for first, second in ((a, 0 * a), (0 * a, a), (0 * a, 0 * a), (a, 3 * a)):
        assert np.allclose(rotation_between(first, second), np.eye(3))

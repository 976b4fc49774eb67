"""Quaternions against scipy's rotations, an oracle with its own arithmetic."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import unit
from studio.engine.base.quaternions import blended, continuous_signs, inverse, multiply, normalized, rotate

COUNT = 200


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(3)
    return Rotation.random(COUNT, random_state=rng), Rotation.random(COUNT, random_state=rng)


def wxyz(rotation):
    return rotation.as_quat(scalar_first=True)


def same(q, rotation):
    return (Rotation.from_quat(q, scalar_first=True).inv() * rotation).magnitude().max() < 1e-7


def test_products_inverses_and_turned_vectors_are_scipy_s(pair):
    a, b = pair
    vectors = np.random.default_rng(4).normal(size=(COUNT, 3))
    assert same(multiply(wxyz(a), wxyz(b)), a * b)
    assert same(inverse(wxyz(a)), a.inv())
    np.testing.assert_allclose(rotate(wxyz(a), vectors), a.apply(vectors), atol=1e-12)
    np.testing.assert_allclose(multiply(wxyz(a[0]), wxyz(b)), multiply(wxyz(a)[[0] * COUNT], wxyz(b)))


def test_products_round_as_scalar_and_vector_part(pair):
    """Only this order of terms keeps the last bit of solves of whole takes and streams."""
    a, b = map(wxyz, pair)
    w, v, bw, bv = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    vector = w * bv + bw * v + np.cross(v, bv)
    assert np.array_equal(multiply(a, b), np.hstack([w * bw - (v * bv).sum(axis=1, keepdims=True), vector]))


def test_lengths_and_signs(pair):
    q = wxyz(pair[0])
    np.testing.assert_allclose(normalized(3.0 * q), q, atol=1e-15)
    flipped = q * np.random.default_rng(5).choice([-1.0, 1.0], (COUNT, 1))
    steady = continuous_signs(flipped)
    assert ((steady[1:] * steady[:-1]).sum(axis=1) >= 0).all() and same(steady, pair[0])


def test_a_vector_without_length_stays_nothing():
    np.testing.assert_array_equal(
        unit(np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]])), [[0, 0.6, 0.8], [0, 0, 0]]
    )


def test_what_is_blended_turns_on_the_shorter_way(pair):
    first, rng = pair[0], np.random.default_rng(6)
    turn = Rotation.from_rotvec(rng.uniform(-0.8, 0.8, (COUNT, 3)))
    a, b = wxyz(first), wxyz(first * turn) * rng.choice([-1.0, 1.0], (COUNT, 1))
    half = Rotation.from_quat(blended(a, b, 0.5), scalar_first=True)
    np.testing.assert_allclose((first.inv() * half).as_rotvec(), 0.5 * turn.as_rotvec(), atol=1e-12)
    np.testing.assert_allclose(blended(a, b, 1.0), b, atol=1e-12)
    np.testing.assert_allclose(np.abs((blended(a, b, np.zeros((COUNT, 1))) * a).sum(axis=1)), 1.0, atol=1e-12)

import numpy as np
import pytest

from studio.engine.model.human.humanoid import FREE_DOFS
from studio.engine.solve.kalman.correction import Correction

NV, JOINTS = 12, 5


@pytest.fixture
def case():
    rng = np.random.default_rng(3)
    half = rng.normal(size=(2 * NV, 2 * NV)) * 0.1
    covariance = half @ half.T
    jacobian = rng.normal(size=(3 * JOINTS, NV)) * 0.5
    half = rng.normal(size=(JOINTS, 3, 3))
    noise = np.matmul(half, half.transpose(0, 2, 1)) * 1e-3 + 1e-4 * np.eye(3)
    off = rng.normal(size=(JOINTS, 3)) * 0.05
    return covariance, jacobian, noise, off


def conditioned(covariance, rows, noise, off):
    """Mean and reduction of covariance by the textbook, with `rows` of the whole state."""
    total = rows @ covariance @ rows.T + noise
    gain = covariance @ rows.T @ np.linalg.inv(total)
    return gain @ off, gain @ rows @ covariance


def blocks(noise):
    whole = np.zeros((3 * len(noise), 3 * len(noise)))
    for k, block in enumerate(noise):
        whole[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = block
    return whole


def make(covariance, jacobian, late_s):
    move = np.hstack([np.eye(NV), late_s * np.eye(NV)])
    return Correction(covariance @ move.T, np.zeros(NV), late_s, jacobian), jacobian @ move


ROOM = np.array([np.full(NV - FREE_DOFS, 10.0), np.full(NV - FREE_DOFS, -10.0)])


@pytest.mark.parametrize("late_s", [0.0, 0.02, -0.05])
def test_it_is_the_conditional_of_a_normal_distribution(case, late_s):
    covariance, jacobian, noise, off = case
    correction, rows = make(covariance, jacobian, late_s)
    information = np.linalg.inv(noise)
    correction.solve(information, np.einsum("jab,jb->ja", information, off), ROOM)
    step, gained = conditioned(covariance, rows, blocks(noise), off.ravel())
    np.testing.assert_allclose(correction.step(), step, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(covariance @ correction.told(), step, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(np.tril(correction.gained()), np.tril(gained), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(correction.moved.ravel(), rows @ step, rtol=1e-6, atol=1e-9)


def test_joints_without_information_take_no_part(case):
    covariance, jacobian, noise, off = case
    correction, rows = make(covariance, jacobian, 0.0)
    information = np.linalg.inv(noise)
    information[[1, 3]] = 0.0
    correction.solve(information, np.einsum("jab,jb->ja", information, off), ROOM)
    kept = [0, 2, 4]
    rows = rows.reshape(JOINTS, 3, -1)[kept].reshape(-1, 2 * NV)
    step, _ = conditioned(covariance, rows, blocks(noise[kept]), off[kept].ravel())
    np.testing.assert_allclose(correction.step(), step, rtol=1e-6, atol=1e-9)


def test_a_second_solve_goes_on_from_where_joints_moved_to(case):
    covariance, jacobian, noise, off = case
    once, _ = make(covariance, jacobian, 0.0)
    information = np.linalg.inv(noise)
    once.solve(information, np.einsum("jab,jb->ja", information, off), ROOM)
    step = once.step()
    once.solve(information, np.einsum("jab,jb->ja", information, off - once.moved), ROOM)
    np.testing.assert_allclose(once.step(), step, rtol=1e-6, atol=1e-9)


def test_a_hinge_led_beyond_its_range_is_held_at_the_end(case):
    covariance, jacobian, noise, off = case
    correction, _ = make(covariance, jacobian, 0.0)
    information = np.linalg.inv(noise)
    correction.solve(information, np.einsum("jab,jb->ja", information, off), ROOM)
    free = correction.step()
    hinge = FREE_DOFS + int(np.abs(free[FREE_DOFS:NV]).argmax())
    room = ROOM.copy()
    room[0 if free[hinge] > 0 else 1, hinge - FREE_DOFS] = 0.5 * free[hinge]
    correction, _ = make(covariance, jacobian, 0.0)
    correction.solve(information, np.einsum("jab,jb->ja", information, off), room)
    assert correction.beyond
    correction.solve(information, np.einsum("jab,jb->ja", information, off - correction.moved), room)
    assert correction.step()[hinge] == pytest.approx(0.5 * free[hinge], abs=1e-5)
    assert not correction.beyond

"""Banded normal equations against dense ones, and rows' Jacobians against finite differences."""

import numpy as np

from studio.engine.whole_take.finish.banded import DAMPING
from studio.engine.whole_take.finish.trajectory import moved
from studio.engine.whole_take.physics.blocks import Blocks
from studio.engine.whole_take.physics.correction import WindowStep
from studio.engine.whole_take.physics.dynamics import dynamics
from studio.engine.whole_take.physics.forces import ARM_M, bearing, contact_forces
from studio.engine.whole_take.physics.points import floor_points
from tests.engine.whole_take.physics.trajectories import DT, body, moving, standing


def test_banded_rows_are_the_dense_ones():
    rng = np.random.default_rng(1)
    frames, nv, rows = 6, 4, 3
    before, here, after = (rng.normal(size=(frames - 2, rows, nv)) for _ in range(3))
    residual = rng.normal(size=(frames - 2, rows))
    blocks = Blocks(
        np.tile(np.eye(nv), (frames, 1, 1)), np.zeros((frames - 1, nv, nv)), np.zeros((frames - 2, nv, nv)),
        np.zeros((frames, nv)),
    )  # fmt: skip
    blocks.add_rows(before, here, after, residual)
    dense = np.zeros(((frames - 2) * rows, frames * nv))
    for k in range(frames - 2):
        for step, part in enumerate((before, here, after)):
            dense[k * rows : (k + 1) * rows, (k + step) * nv : (k + step + 1) * nv] = part[k]
    matrix = dense.T @ dense + (1.0 + DAMPING) * np.eye(frames * nv)
    expected = np.linalg.solve(matrix, -dense.T @ residual.ravel())
    assert np.allclose(blocks.solve().ravel(), expected)


def test_wrench_jacobians_are_the_differences():
    points, small = floor_points(body()), 1e-6
    correction = WindowStep(body(), DT)
    for q in (moving(), standing()):
        motion = dynamics(body(), q, DT, points)
        forces = contact_forces(motion, bearing(motion, points, 0.0))
        jacobians = correction._wrench_jacobians(motion, forces)
        rng = np.random.default_rng(5)
        for _ in range(4):
            frame, way = 10, rng.normal(size=q.shape[1] - 1)
            step = np.zeros((len(q), q.shape[1] - 1))
            step[frame] = small * way
            other = dynamics(body(), moved(q, step), DT, points)
            arms = np.cross(
                motion.com[1:-1] - other.com[1:-1], forces.at_points.sum(axis=1)
            )  # the moment of constant forces
            change = (
                np.hstack([other.force - motion.force, (other.moment - motion.moment - arms) / ARM_M]) / small
            )
            for offset, jacobian in zip((-1, 0, 1), reversed(jacobians), strict=True):
                k = frame - 1 + offset
                expected = jacobian[k] @ way
                assert np.abs(change[k, :3] - expected[:3]).max() < 1e-3 * np.abs(expected[:3]).max()
                assert np.abs(change[k, 3:] - expected[3:]).max() < 0.05 * np.abs(expected[3:]).max()

"""Balls of the browser view are closed, face outwards and are round."""

import numpy as np
import pytest

from studio.web.scene.balls import ball


@pytest.mark.parametrize(("rings", "sectors"), [(3, 4), (9, 12)])
def test_a_ball_is_closed_round_and_faces_outwards(rings, sectors):
    vertices, faces = ball(rings, sectors)
    edges = np.sort(
        np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(int), axis=1
    )
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, atol=1e-6)
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    assert (np.einsum("ij,ij->i", a, np.cross(b, c)) > 0).all()

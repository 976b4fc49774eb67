"""The mannequin's parts lie where the joints are."""

import numpy as np
import pytest

from studio.engine.joints import OUTPUT_INDEX
from studio.render.body import PARTS, body_scale, place
from studio.render.shapes import SHAPES, mesh
from tests.render.figures import t_pose


def test_meshes_are_closed_and_face_outwards() -> None:
    for shape in SHAPES:
        vertices, faces = mesh(shape)
        edges = np.sort(
            np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(int), axis=1
        )
        _, counts = np.unique(edges, axis=0, return_counts=True)
        assert (counts == 2).all(), shape
        a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0, shape  # signed volume


def test_parts_follow_any_pose_rigidly() -> None:
    positions, wxyz = t_pose()
    rest = place(positions, wxyz, 1.0)
    half = np.sqrt(0.5)
    R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # a quarter turn about z
    turned = place(positions @ R.T + [1, 2, 0], np.tile([half, 0, 0, half], (52, 1)), 1.0)
    np.testing.assert_allclose(turned.positions_m, rest.positions_m @ R.T + [1, 2, 0], atol=1e-9)
    np.testing.assert_allclose(turned.rotations, R @ rest.rotations, atol=1e-9)
    np.testing.assert_allclose(turned.scales_m, rest.scales_m, atol=1e-9)


def test_placement_is_right_handed_and_finite_for_a_collapsed_pose() -> None:
    placement = place(np.zeros((52, 3)), np.tile([1.0, 0, 0, 0], (52, 1)), 1.0)
    assert np.isfinite(placement.rotations).all()
    np.testing.assert_allclose(np.linalg.det(placement.rotations), 1.0, atol=1e-6)
    assert (placement.scales_m > 0).all()


def test_the_figure_stands_on_the_floor_and_has_its_height() -> None:
    positions, wxyz = t_pose()
    placement = place(positions, wxyz, body_scale(positions))
    points = np.concatenate([
        (mesh(part.shape)[0] * placement.scales_m[i]) @ placement.rotations[i].T + placement.positions_m[i]
        for i, part in enumerate(PARTS)
    ])  # fmt: skip
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.03)
    assert points[:, 2].max() == pytest.approx(1.75, abs=0.06)
    assert points[:, 0].max() > positions[OUTPUT_INDEX["LeftHandMiddle3"], 0]

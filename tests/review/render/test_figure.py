"""Pictures show the mannequin: its triangles in the right pixels, on the floor, its face forward."""

import numpy as np
import pytest

from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.model.joints import OUTPUT_INDEX
from studio.review.render.figure import Projection, draw_figure
from studio.review.render.raster import nearest
from tests.review.render.figures import sidestep, t_pose

SQUARE = np.array([[2.0, 1.0, 1.0], [10.0, 1.0, 1.0], [10.0, 7.0, 3.0], [2.0, 7.0, 3.0]])
FACING = np.array([[0, 3, 2], [0, 2, 1]], dtype=np.uint32)  # rows go down: counter-clockwise as seen


def test_pixels_of_a_square_are_covered_once_with_their_depth():
    pixels, triangle, shares, depth = nearest(SQUARE, FACING, 16, 12)
    rows, columns = np.divmod(pixels, 16)
    expected = {(r, c) for r in range(1, 7) for c in range(2, 10)}
    assert set(zip(rows.tolist(), columns.tolist(), strict=True)) == expected and len(pixels) == 48
    np.testing.assert_allclose(depth, 1.0 + 2.0 * (rows + 0.5 - 1.0) / 6.0)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    at = np.einsum("nk,nki->ni", shares, SQUARE[FACING[triangle]])
    np.testing.assert_allclose(at[:, :2], np.column_stack([columns, rows]) + 0.5)


def test_the_nearer_triangle_is_seen_and_one_seen_from_inside_is_not():
    nearer = SQUARE + np.array([4.0, 0.0, -5.0])
    both = np.concatenate([SQUARE, nearer]), np.concatenate([FACING, FACING + 4])
    for triangles in (both[1], both[1][::-1]):
        pixels, _, _, depth = nearest(both[0], triangles, 16, 12)
        assert np.array_equal(depth < 0.0, pixels % 16 >= 6)
    assert len(nearest(SQUARE, FACING[:, ::-1], 16, 12)[0]) == 0
    assert len(nearest(SQUARE + np.array([-6.0, -3.0, 0.0]), FACING, 16, 12)[0]) == 4 * 4  # cut by the edge


def test_the_figure_stands_on_the_floor_and_has_its_height():
    positions, wxyz = t_pose()
    points, normals = Mannequin.of(sidestep()).posed(positions, wxyz)
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.03)
    assert points[:, 2].max() == pytest.approx(1.75, abs=0.08)
    assert points[:, 0].max() > positions[OUTPUT_INDEX["LeftHandMiddle3"], 0]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)


def test_a_turned_pose_is_the_same_body_turned():
    positions, wxyz = t_pose()
    mannequin, half = Mannequin.of(sidestep()), np.sqrt(0.5)
    R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # a quarter turn about z
    turned = mannequin.posed(positions @ R.T + [1, 2, 0], np.tile([half, 0, 0, half], (52, 1)))
    rest = mannequin.posed(positions, wxyz)
    np.testing.assert_allclose(turned[0], rest[0] @ R.T + [1, 2, 0], atol=1e-6)
    np.testing.assert_allclose(turned[1], rest[1] @ R.T, atol=1e-6)


def test_the_face_has_a_visor_ahead_and_none_behind():
    positions, wxyz = t_pose()
    mannequin, size = Mannequin.of(sidestep()), 200
    head = mannequin.mesh.joint_indices[:, 0] == OUTPUT_INDEX["Head"]
    x, y, z = mannequin.posed(positions, wxyz)[0][head].mean(axis=0).tolist()
    visor = []
    for yaw in (0.0, 90.0, 180.0):
        view = Projection(size, size, 300.0, yaw, 2.0, (x, y, z), 0.5)
        red, _, blue = np.moveaxis(draw_figure(mannequin, positions, wxyz, view)[60:100].astype(float), 2, 0)
        visor.append(int((blue > 1.15 * red).sum()))
    assert visor[0] > 2 * visor[1] > 0 == visor[2]

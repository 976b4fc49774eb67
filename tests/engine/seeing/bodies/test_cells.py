"""Which person each cell of an image belongs to, and who stands within one cluster."""

import numpy as np

from studio.engine.seeing.bodies.cells import shared_out
from studio.engine.seeing.bodies.columns import apart, standing_in
from studio.engine.seeing.images.clusters import Clusters, clusters_of


def test_a_cell_between_bodies_is_of_the_one_that_it_hangs_together_with():
    labels = np.zeros((1, 9), np.int32)
    depth = np.full((1, 9), 2.0)
    depth[0, 5:] = 2.5  # the other person stands behind
    cells = np.stack([np.zeros(9, np.int64), np.arange(9)], axis=1)
    distance = np.full((9, 2), 0.3)
    distance[0] = 0.0, 0.4
    distance[8] = 0.4, 0.0
    distance[4] = 0.3, 0.1  # a hand in front of the other person's chest
    owner = shared_out(depth, labels, cells, distance, 0.07, 0.04)
    assert owner.tolist() == [0] * 5 + [1] * 4


def test_a_cluster_that_nobody_surely_has_is_of_the_nearest():
    labels = np.zeros((1, 3), np.int32)
    cells = np.stack([np.zeros(3, np.int64), np.arange(3)], axis=1)
    distance = np.array([[0.2, 0.15], [0.1, 0.2], [0.3, 0.1]])
    assert shared_out(np.ones((1, 3)), labels, cells, distance, 0.07, 0.04).tolist() == [1, 1, 1]


def picture(*boxes):
    """Points, depth and clusters of upright boards in the plane y = 3: (left, right, low, high), each [m]."""
    rows, columns = 120, 200
    angle = 0.02 / 3.0
    x = (np.arange(columns) - columns / 2) * 0.02
    z = 2.4 - np.arange(rows) * 0.02
    points = np.stack([*np.meshgrid(x, z), np.full((rows, columns), 3.0)], axis=2)[..., [0, 2, 1]]
    use = np.zeros((rows, columns), bool)
    for left, right, low, high in boxes:
        use |= (
            (points[..., 0] > left)
            & (points[..., 0] < right)
            & (points[..., 2] > low)
            & (points[..., 2] < high)
        )
    depth = np.where(use, 3.0, 0.0)
    points = np.ascontiguousarray(points)
    return points, depth, Clusters(*clusters_of(points, depth, use, angle, 20, 40)), angle


TRUNKS = (-0.7, -0.4, 0.0, 1.7), (0.4, 0.7, 0.0, 1.6)
ARMS = (-0.6, 0.6, 1.3, 1.4), (-1.4, -0.6, 1.3, 1.4), (0.6, 1.3, 1.3, 1.4)


def test_two_who_hold_hands_are_parted_between_their_hands():
    points, depth, clusters, angle = picture(*TRUNKS, *ARMS)
    assert len(clusters.count) == 1
    parts = apart(points, depth, clusters, angle)
    assert len(parts.count) == 2 and parts.count.sum() == clusters.count.sum()
    left = int(parts.middle[:, 0].argmin())
    assert abs(parts.high[left, 0]) < 0.15 and abs(parts.low[1 - left, 0]) < 0.15
    assert np.isclose(parts.area.sum(), clusters.area.sum())


def test_one_with_arms_and_legs_apart_and_a_wall_stay_whole():
    one = (-0.2, 0.2, 0.0, 1.7), (-0.8, 0.8, 1.3, 1.4)
    wall = (-1.9, 1.9, 0.0, 2.39)
    for boxes in (one, (wall,)):
        points, depth, clusters, angle = picture(*boxes)
        assert apart(points, depth, clusters, angle) is clusters


def test_nobody_stands_in_what_is_low():
    places = np.random.default_rng(0).uniform([0, 0, 0], [2, 1, 0.6], (500, 3))
    assert len(standing_in(places, np.full(500, 0.02))) == 0

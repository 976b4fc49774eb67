"""Training of the small networks: its samples, and that the networks learn."""

from pathlib import Path

import numpy as np

from studio.engine.seeing.hands.shape import shape_networks
from studio.engine.seeing.head import head_networks
from studio.engine.seeing.images.convolution import Committee
from studio.simulator.training.convolution_training import (
    Lesson,
    Samples,
    of_distance,
    of_log_odds,
    train_convolution,
)
from studio.simulator.training.hand_training import hand_samples, read_clips
from studio.simulator.training.head_training import head_samples
from studio.simulator.training.training_views import training_views


def test_convolutions_learn_and_repeat_to_the_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    windows = rng.normal(size=(2000, 14, 14, 2)).astype(np.float32)
    bright = rng.random(2000) < 0.5
    windows[bright, 4:8, 5:9, 0] += 1.5
    samples = Samples(windows, np.zeros((2000, 2), np.float32), bright[:, None].astype(np.float32))

    def fit():
        lesson = Lesson(of_log_odds, np.ones(1, np.float32), (12, 24), 48, epochs=12, dropout=0.3, decay=2e-2)
        return train_convolution(samples, lesson, np.random.default_rng(2))

    network = fit()
    outputs = network(windows, samples.about)
    assert ((outputs[:, 0] > 0) == bright).mean() > 0.85
    np.testing.assert_array_equal(outputs, fit()(windows, samples.about))
    Committee((network, network)).save(tmp_path / "n.npz")
    again = Committee.load(tmp_path / "n.npz")(windows, samples.about)
    np.testing.assert_allclose(again, outputs, atol=0.05)


def test_what_points_aside_points_to_the_other_side_in_a_mirror_image() -> None:
    rng = np.random.default_rng(6)
    windows = rng.normal(0, 0.3, (1500, 14, 14, 1)).astype(np.float32)
    left = rng.random(1500) < 0.9  # few samples show the right side: the mirror images of the others do
    windows[left, 4:10, 1:6] += 1.0
    windows[~left, 4:10, 8:13] += 1.0
    targets = np.where(left, -1.0, 1.0)[:, None].astype(np.float32)
    lesson = Lesson(of_distance, -np.ones(1, np.float32), (6, 8), 16, epochs=25, dropout=0.1, decay=5e-3)
    samples = Samples(windows, np.zeros((1500, 1), np.float32), targets)
    network = train_convolution(samples, lesson, rng)
    outputs = network(windows, samples.about)[:, 0]
    assert (outputs[left] < 0).mean() > 0.95 and (outputs[~left] > 0).mean() > 0.95
    assert np.abs(network(windows[:, :, ::-1], samples.about)[:, 0] + outputs).mean() < 0.3


def test_views_give_samples_that_the_networks_know_something_of() -> None:
    rng = np.random.default_rng(3)
    views = list(training_views(read_clips([]), 1, 6, rng))
    assert {view.what for view in views} == {"left", "right", "head"}
    for view in views:
        assert view.depth_mm.shape == (view.camera.height, view.camera.width) and view.depth_mm.any()
        np.testing.assert_allclose(view.R_camera_head @ view.R_camera_head.T, np.eye(3), atol=1e-9)
    samples = hand_samples(views, rng)
    is_open = samples.targets[:, 0] > 0.5
    right = (shape_networks()(samples.windows, samples.about)[:, 0] > 0) == is_open
    assert len(is_open) > 5 and right.mean() > 0.5
    heads = head_samples(views, rng)
    arrows = head_networks()(heads.windows, heads.about)
    facing = heads.targets[:, 2] < -0.3
    assert np.median((arrows[facing, :3] * heads.targets[facing, :3]).sum(axis=1)) > 0.8

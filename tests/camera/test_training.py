"""Training of the small networks: what it is given, and that it learns."""

from pathlib import Path

import numpy as np

from studio.camera.simulator.convolution_training import Samples, train_convolution
from studio.camera.simulator.hand_training import hand_samples, read_clips
from studio.camera.simulator.head_training import head_samples, mirrored
from studio.camera.simulator.network_training import joined, train
from studio.camera.simulator.training_views import training_views
from studio.engine.hands.convolution import Committee
from studio.engine.hands.shape import shape_networks
from studio.engine.head import head_network


def test_a_network_learns_and_repeats_to_the_bit() -> None:
    rng = np.random.default_rng(1)
    inputs = rng.normal(size=(2000, 6)).astype(np.float32)
    targets = (inputs[:, :1] * inputs[:, 1:2] > 0).astype(np.float32)  # no straight line parts them

    def fit():
        return train(
            inputs,
            targets,
            (16,),
            lambda z, y: 2 * (z - y),
            np.random.default_rng(2),
            epochs=200,
            dropout=0.0,
        )

    network = fit()
    assert ((network(inputs)[:, 0] > 0.5) == (targets[:, 0] > 0.5)).mean() > 0.9
    np.testing.assert_array_equal(network(inputs), fit()(inputs))


def test_joined_networks_give_the_mean() -> None:
    rng = np.random.default_rng(4)
    inputs = rng.normal(size=(300, 6)).astype(np.float32)
    targets = rng.normal(size=(300, 2)).astype(np.float32)
    members = [
        train(inputs[k * 100 :], targets[k * 100 :], (5 + k, 4), lambda z, y: 2 * (z - y), rng, epochs=2)
        for k in range(3)
    ]
    expected = np.mean([network(inputs) for network in members], axis=0)
    np.testing.assert_allclose(joined(members)(inputs), expected, atol=1e-9)


def test_convolutions_learn_and_repeat_to_the_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    windows = rng.normal(size=(2000, 14, 14, 2)).astype(np.float32)
    bright = rng.random(2000) < 0.5
    windows[bright, 4:8, 5:9, 0] += 1.5
    samples = Samples(windows, np.zeros((2000, 2), np.float32), bright[:, None].astype(np.float32))

    def fit():
        return train_convolution(samples, np.random.default_rng(2), epochs=12)

    network = fit()
    outputs = network(windows, samples.about)
    assert ((outputs[:, 0] > 0) == bright).mean() > 0.85
    np.testing.assert_array_equal(outputs, fit()(windows, samples.about))
    Committee((network, network)).save(tmp_path / "n.npz")
    again = Committee.load(tmp_path / "n.npz")(windows, samples.about)
    np.testing.assert_allclose(again, outputs, atol=0.05)


def test_views_give_samples_that_the_networks_know_something_of() -> None:
    rng = np.random.default_rng(3)
    views = list(training_views(read_clips([]), 1, 6, rng))
    assert {view.what for view in views} == {"left", "right", "head"}
    for view in views:
        assert view.depth_mm.shape == (view.camera.height, view.camera.width) and view.depth_mm.any()
        np.testing.assert_allclose(view.R_camera_head @ view.R_camera_head.T, np.eye(3), atol=1e-9)
    samples = hand_samples(views, rng)
    is_open = samples.open_share[:, 0] > 0.5
    right = (shape_networks()(samples.windows, samples.about)[:, 0] > 0) == is_open
    assert len(is_open) > 5 and right.mean() > 0.5
    inputs, targets = head_samples(views, rng)
    arrows = head_network()(inputs)
    facing = targets[:, 2] < -0.3
    assert np.median((arrows[facing, :3] * targets[facing, :3]).sum(axis=1)) > 0.7
    flipped, turned = mirrored(inputs, targets)
    np.testing.assert_array_equal(mirrored(flipped, turned)[0], inputs)
    assert (turned[:, 0] == -targets[:, 0]).all() and (turned[:, 1] == targets[:, 1]).all()

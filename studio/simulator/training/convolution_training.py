"""Training of small convolutional networks on simulated windows: plain numpy, same numbers for the same seed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.images.convolution import KERNELS, Convolution, patches

Array32 = NDArray[np.float32]

_BATCH = 128
_RATE = 2e-3
_WARM_UP = 50
_SMOOTHED = 0.02
"""Label smoothing: distance of targets from 0 and 1."""

Slope = Callable[[Array32, Array32], Array32]
"""Derivative of a loss by the outputs, given outputs and targets, all of shape (n, outputs)."""


@dataclass(frozen=True)
class Samples:
    """Training samples of a network.

    Attributes:
        windows: shape (n, side, side, channels). about: further inputs, shape (n, about). targets: (n, outputs).
    """

    windows: Array32
    about: Array32
    targets: Array32


@dataclass(frozen=True)
class Lesson:
    """Options of a training.

    Attributes:
        slope: derivative of the loss.
        mirror: factors of the targets for a mirror image, shape (outputs,).
        channels: outputs of the convolutions. hidden: of the first dense layer.
        epochs: passes over the samples.
        dropout: share of the dense layer's inputs dropped at random.
        decay: weight decay, as a share of the learning rate.
    """

    slope: Slope
    mirror: Array32
    channels: tuple[int, ...]
    hidden: int
    epochs: int
    dropout: float
    decay: float


def of_log_odds(outputs: Array32, targets: Array32) -> Array32:
    """Derivative of the cross-entropy between targets in 0..1 and outputs in log-odds."""
    wanted = targets * (1 - 2 * _SMOOTHED) + _SMOOTHED
    return np.divide(1, 1 + np.exp(-outputs)) - wanted


def of_distance(outputs: Array32, targets: Array32) -> Array32:
    """Derivative of the squared distance between outputs and targets, which fits outputs to the mean target."""
    return 2 * (outputs - targets)


def train_convolution(samples: Samples, lesson: Lesson, rng: np.random.Generator) -> Convolution:
    """Return a network trained by Adam with decoupled weight decay; half of the windows are mirrored along their
    second axis.

    Args:
        samples: to train on.
        lesson: options.
        rng: random generator of initial weights, order, mirroring and dropout.

    Source: Kingma and Ba 2015 (Adam); Loshchilov and Hutter 2019 (decoupled decay, cosine schedule).
    """
    count = len(samples.windows)
    layers = _first_layers(samples, lesson, rng)
    mean = samples.about.mean(axis=0)
    network = Convolution(mean, samples.about.std(axis=0) + np.float32(0.05), tuple(layers))
    moments = [(np.zeros_like(part), np.zeros_like(part)) for part in layers]
    inputs = layers[2 * len(KERNELS)].shape[0]
    steps, step = lesson.epochs * -(-count // _BATCH), 0
    for _ in range(lesson.epochs):
        order = rng.permutation(count)
        for begin in range(0, count, _BATCH):
            batch = order[begin : begin + _BATCH]
            mirrored = rng.random(len(batch)) < 0.5
            windows = samples.windows[batch]
            windows[mirrored] = windows[mirrored, :, ::-1]
            targets = np.where(mirrored[:, None], lesson.mirror, np.float32(1)) * samples.targets[batch]
            kept = np.divide(
                rng.random((len(batch), inputs)) > lesson.dropout, np.float32(1 - lesson.dropout)
            )
            gradients = _gradients(network, windows, samples.about[batch], kept, lesson.slope, targets)
            step += 1
            rate = _RATE * 0.5 * (1 + np.cos(np.pi * step / steps)) * min(1.0, step / _WARM_UP)
            for part, (first, second), change in zip(layers, moments, gradients, strict=True):
                first += np.float32(0.1) * (change - first)
                second += np.float32(0.001) * (change * change - second)
                size = np.sqrt(second / (1 - 0.999**step)) + 1e-8
                part -= np.float32(rate) * (
                    first / (1 - 0.9**step) / size + lesson.decay * part * (part.ndim == 2)
                )
    return network


def _first_layers(samples: Samples, lesson: Lesson, rng: np.random.Generator) -> list[Array32]:
    """Return random weights and zero biases (He 2015)."""
    layers: list[Array32] = []
    _, side, _, channels = samples.windows.shape
    for (width, stride), outputs in zip(KERNELS, lesson.channels, strict=True):
        layers += _dense(width * width * channels, outputs, rng)
        side, channels = (side - width) // stride + 1, outputs
    layers += _dense(side * side * channels + samples.about.shape[1], lesson.hidden, rng)
    return layers + _dense(lesson.hidden, samples.targets.shape[1], rng)


def _dense(inputs: int, outputs: int, rng: np.random.Generator) -> list[Array32]:
    weights = rng.normal(0, np.sqrt(2 / inputs), (inputs, outputs)).astype(np.float32)
    return [weights, np.zeros(outputs, np.float32)]


def _gradients(
    network: Convolution, windows: Array32, about: Array32, kept: Array32, slope: Slope, targets: Array32
) -> list[Array32]:
    """Return the derivative of the loss by every weight and bias, with only the `kept` dense inputs."""
    layers, convolutions = network.layers, len(KERNELS)
    values, seen = windows, []
    for k, (width, stride) in enumerate(KERNELS):
        rows = patches(values, width, stride)
        out = np.maximum(rows @ layers[2 * k] + layers[2 * k + 1], 0)
        seen.append((values.shape, rows, out))
        values = out
    flat = np.concatenate([values.reshape(len(values), -1), (about - network.mean) / network.scale], axis=1)
    flat = flat * kept
    first, first_bias, last, last_bias = layers[2 * convolutions :]
    hidden = np.maximum(flat @ first + first_bias, 0)
    steep = (slope(hidden @ last + last_bias, targets) / len(windows)).astype(np.float32)
    back = (steep @ last.T) * (hidden > 0)
    gradients = [flat.T @ back, back.sum(axis=0), hidden.T @ steep, steep.sum(axis=0)]
    back = ((back @ first.T) * kept)[:, : values[0].size].reshape(values.shape)
    for k in range(convolutions - 1, -1, -1):
        shape, rows, out = seen[k]
        back = back * (out > 0)
        flat_back = back.reshape(-1, back.shape[-1])
        gradients = [rows.reshape(-1, rows.shape[-1]).T @ flat_back, flat_back.sum(axis=0), *gradients]
        if k:
            back = _spread(flat_back @ layers[2 * k].T, back.shape, shape, *KERNELS[k])
    return gradients


def _spread(
    rows: Array32, patch_shape: tuple[int, ...], shape: tuple[int, ...], width: int, stride: int
) -> Array32:
    """Return images of `shape` as sums of the rows of patches: the adjoint of `patches`."""
    parts = rows.reshape(*patch_shape[:3], width, width, shape[3])
    out = np.zeros(shape, np.float32)
    down, right = stride * patch_shape[1], stride * patch_shape[2]
    for i in range(width):
        for j in range(width):
            out[:, i : i + down : stride, j : j + right : stride] += parts[:, :, :, i, j]
    return out

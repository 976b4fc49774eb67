"""Training of the engine's small networks on simulated views: plain numpy, same numbers for the same seed."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from studio.engine.network import Network

Array32 = NDArray[np.float32]
_BATCH = 256


def train(
    inputs: Array32,
    targets: Array32,
    hidden: tuple[int, ...],
    slope: Callable[[Array32, Array32], Array32],
    rng: np.random.Generator,
    *,
    epochs: int = 25,
    rate: float = 2e-3,
    decay: float = 5e-3,
    dropout: float = 0.15,
) -> Network:
    """Return a network trained by Adam with decoupled weight decay, dropout of inputs, and a falling rate.

    Args:
        inputs: shape (n, inputs).
        targets: shape (n, outputs).
        hidden: sizes of the hidden layers.
        slope: derivative of the loss with respect to the outputs, of (outputs, targets), both (batch, outputs).
        rng: of the first weights, the order and the dropout.
        epochs, rate, decay, dropout: see above.

    Source: Kingma and Ba 2015 (Adam); Loshchilov and Hutter 2019 (decoupled decay, cosine schedule).
    """
    mean, scale = inputs.mean(axis=0), inputs.std(axis=0) + np.float32(0.05)
    scaled = (inputs - mean) / scale
    sizes = (inputs.shape[1], *hidden, targets.shape[1])
    layers = [
        [rng.normal(0, np.sqrt(2 / a), (a, b)).astype(np.float32), np.zeros(b, np.float32)]
        for a, b in pairwise(sizes)
    ]
    moments = [[(np.zeros_like(part), np.zeros_like(part)) for part in layer] for layer in layers]
    step, steps = 0, epochs * -(-len(inputs) // _BATCH)
    for _ in range(epochs):
        order = rng.permutation(len(inputs))
        for begin in range(0, len(inputs), _BATCH):
            batch = order[begin : begin + _BATCH]
            kept = rng.random(inputs.shape[1], dtype=np.float32) > dropout
            gradients = _gradients(layers, scaled[batch] * kept, targets[batch], slope)
            now = rate * 0.5 * (1 + np.cos(np.pi * step / steps))
            step += 1
            for layer, moment, gradient in zip(layers, moments, gradients, strict=True):
                for part, (first, second), change in zip(layer, moment, gradient, strict=True):
                    first += 0.1 * (change - first)
                    second += 0.001 * (change * change - second)
                    size = np.sqrt(second / (1 - 0.999**step)) + 1e-8
                    part -= np.float32(now) * (
                        first / (1 - 0.9**step) / size + decay * part * (part.ndim == 2)
                    )
    return Network(
        mean.astype(float), scale.astype(float), tuple((w.astype(float), b.astype(float)) for w, b in layers)
    )


def joined(networks: list[Network]) -> Network:
    """Return one network whose outputs are the means of those of several with as many layers: they err apart."""
    mean, scale = networks[0].mean, networks[0].scale
    layers = []
    for k in range(len(networks[0].layers)):
        parts = [network.layers[k] for network in networks]
        biases = [bias for _, bias in parts]
        if k == 0:  # all take their inputs in the first one's scale
            biases = [b + ((mean - n.mean) / n.scale) @ w for n, (w, b) in zip(networks, parts, strict=True)]
            weights = np.hstack(
                [w * (scale / n.scale)[:, None] for n, (w, _) in zip(networks, parts, strict=True)]
            )
        elif k < len(networks[0].layers) - 1:
            weights = block_diag(*(w for w, _ in parts))
        else:
            weights = np.vstack([w for w, _ in parts]) / len(networks)
            biases = [np.mean(biases, axis=0)]
        layers.append((weights, np.concatenate(biases)))
    return Network(mean, scale, tuple(layers))


def _gradients(
    layers: list[list[Array32]],
    inputs: Array32,
    targets: Array32,
    slope: Callable[[Array32, Array32], Array32],
) -> list[tuple[Array32, Array32]]:
    values = [inputs]
    for k, (weights, biases) in enumerate(layers):
        out = values[-1] @ weights + biases
        values.append(np.maximum(out, 0) if k < len(layers) - 1 else out)
    back = slope(values[-1], targets) / np.float32(len(inputs))
    gradients = []
    for k in range(len(layers) - 1, -1, -1):
        gradients.append((values[k].T @ back, back.sum(axis=0)))
        if k:
            back = (back @ layers[k][0].T) * (values[k] > 0)
    return gradients[::-1]

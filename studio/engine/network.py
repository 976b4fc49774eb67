"""A small neural network: layers of weights with ReLU between them, kept in an `.npz`."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Network:
    """A function of rows of inputs.

    Attributes:
        mean, scale: of the inputs, shape (inputs,).
        layers: weights, shape (inputs, outputs), and biases, shape (outputs,), from the first to the last.
    """

    mean: Array
    scale: Array
    layers: tuple[tuple[Array, Array], ...]

    def __call__(self, inputs: Array) -> Array:
        """Return the outputs of rows of inputs, shape (n, inputs) -> (n, outputs)."""
        values = (inputs - self.mean) / self.scale
        for k, (weights, biases) in enumerate(self.layers):
            values = values @ weights + biases
            if k < len(self.layers) - 1:
                values = np.maximum(values, 0.0)
        return values

    def save(self, path: Path) -> None:
        """Write the network, in half precision."""
        arrays = {"mean": self.mean, "scale": self.scale}
        for k, (weights, biases) in enumerate(self.layers):
            arrays |= {f"weights_{k}": weights, f"biases_{k}": biases}
        np.savez_compressed(path, **{name: value.astype(np.float16) for name, value in arrays.items()})

    @staticmethod
    def load(path: Path) -> "Network":
        """Return the network in a file."""
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name].astype(np.float64) for name in file.files}
        count = sum(name.startswith("weights_") for name in arrays)
        layers = tuple((arrays[f"weights_{k}"], arrays[f"biases_{k}"]) for k in range(count))
        return Network(arrays["mean"], arrays["scale"], layers)

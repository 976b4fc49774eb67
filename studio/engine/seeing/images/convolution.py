"""A small convolutional network for windows of a depth image, stored in an `.npz`."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array32 = NDArray[np.float32]

KERNELS: tuple[tuple[int, int], ...] = ((5, 2), (3, 2))
"""Width and stride of the convolutions, from the first to the last."""


@dataclass(frozen=True)
class Convolution:
    """A function of windows and of numbers about each: convolutions, then two dense layers, ReLU between them.

    Attributes:
        mean, scale: of the numbers about a window, shape (about,).
        layers: weights and biases in turn, shapes (width * width * channels, outputs), (outputs,) for a convolution,
            (inputs, outputs), (outputs,) for a dense layer; the first dense layer also takes the windows' numbers.
    """

    mean: Array32
    scale: Array32
    layers: tuple[Array32, ...]

    def __call__(self, windows: Array32, about: Array32) -> Array32:
        """Return the outputs of windows, shape (n, side, side, channels), and numbers, (n, about): shape (n, out)."""
        values = windows
        for k, (width, stride) in enumerate(KERNELS):
            weights, biases = self.layers[2 * k : 2 * k + 2]
            values = np.maximum(patches(values, width, stride) @ weights + biases, 0)
        flat = np.concatenate([values.reshape(len(values), -1), (about - self.mean) / self.scale], axis=1)
        first, first_bias, last, last_bias = self.layers[2 * len(KERNELS) :]
        return np.maximum(flat @ first + first_bias, 0) @ last + last_bias


def patches(values: Array32, width: int, stride: int) -> Array32:
    """Return the square patches of images, shape (n, rows, columns, channels), one per row: shape
    (n, patch_rows, patch_columns, width * width * channels).
    """
    some = np.lib.stride_tricks.sliding_window_view(values, (width, width), axis=(1, 2))
    some = some[:, ::stride, ::stride].transpose(0, 1, 2, 4, 5, 3)
    return np.ascontiguousarray(some).reshape(*some.shape[:3], -1)


@dataclass(frozen=True)
class Committee:
    """The mean of several networks, whose errors differ."""

    members: tuple[Convolution, ...]

    def __call__(self, windows: Array32, about: Array32) -> Array32:
        """Return the mean outputs; see `Convolution`."""
        return np.mean([member(windows, about) for member in self.members], axis=0)

    def save(self, path: Path) -> None:
        """Write the networks, in half precision."""
        arrays = {}
        for k, member in enumerate(self.members):
            for i, array in enumerate((member.mean, member.scale, *member.layers)):
                arrays[f"{k}_{i}"] = array.astype(np.float16)
        np.savez_compressed(path, **arrays)

    @staticmethod
    def load(path: Path) -> "Committee":
        """Return the networks in a file."""
        with np.load(path, allow_pickle=False) as file:
            arrays = {tuple(map(int, name.split("_"))): file[name].astype(np.float32) for name in file.files}
        members = []
        for k in range(1 + max(member for member, _ in arrays)):
            mean, scale, *layers = (arrays[k, i] for i in range(sum(member == k for member, _ in arrays)))
            members.append(Convolution(mean, scale, tuple(layers)))
        return Committee(tuple(members))

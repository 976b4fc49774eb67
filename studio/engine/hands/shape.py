"""Open hand or fist by the shape of the hand's part of the depth image.

A small network looks at the samples of a `HandWindow`, which are in units of the forearm, so that size and distance
cancel; its output is the log-odds of open. The weights, `shape.npz`, come from simulated hands:
`python -m studio.camera.simulator.hand_training` makes them again.
"""

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.hands.window import COLUMNS, ROWS, HandWindow
from studio.engine.network import Network

WEIGHTS = Path(__file__).with_name("shape.npz")


def window_inputs(window: HandWindow) -> NDArray[np.float64]:
    """Return a window as the network's inputs, shape (inputs,): filled as it is, nearness in blocks of 2 x 2."""
    blocks = (ROWS // 2, 2, COLUMNS // 2, 2)
    weight = window.filled.reshape(blocks).sum(axis=(1, 3))
    nearer = (window.filled * window.nearer).reshape(blocks).sum(axis=(1, 3)) / np.maximum(weight, 0.25)
    about = [window.along_ray, window.forearm_px / 30.0, window.distance_m / 3.0]
    return np.concatenate([window.filled.ravel(), 4.0 * nearer.ravel(), about])


@cache
def shape_network() -> Network:
    """Return the network of `shape.npz`."""
    return Network.load(WEIGHTS)

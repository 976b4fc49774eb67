"""Open hand or fist by the shape of the hand's part of the depth image.

Small convolutional networks take a `HandWindow` in units of the forearm, so that size and distance cancel. Their mean
output is the log-odds of an open hand. The weights, `shape.npz`, come from simulated hands:
`python -m studio.simulator.training.hand_training` recreates them.
"""

from functools import cache
from pathlib import Path

from studio.engine.seeing.images.convolution import Committee

WEIGHTS = Path(__file__).with_name("shape.npz")


@cache
def shape_networks() -> Committee:
    """Return the networks of `shape.npz`."""
    return Committee.load(WEIGHTS)

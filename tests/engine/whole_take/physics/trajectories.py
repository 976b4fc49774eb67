"""Trajectories of the authored humanoid with known physics."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from tests.engine.walkers import humanoid

DT = 1.0 / 60.0
GRAVITY = 9.81


def body() -> Humanoid:
    return humanoid()


def standing(frames: int = 30) -> NDArray[np.float64]:
    """The T-pose's straight stance, soles on the floor."""
    q = np.tile(body().rest_qpos, (frames, 1))
    q[:, 7:] = 0.0
    return q


def thrown(frames: int = 30) -> NDArray[np.float64]:
    """The same body in free flight, upwards and forwards, a metre above the floor."""
    q, t = standing(frames), np.arange(frames) * DT
    q[:, 1] -= 1.5 * t
    q[:, 2] += 1.0 + 2.0 * t - 0.5 * GRAVITY * t**2
    return q


def moving(frames: int = 24, seed: int = 3) -> NDArray[np.float64]:
    """A smooth motion of every degree of freedom, a metre above the floor."""
    rng = np.random.default_rng(seed)
    q, t = standing(frames), np.arange(frames) * DT
    amplitude, phase = rng.uniform(0.02, 0.2, q.shape[1] - 7), rng.uniform(0, 6, q.shape[1] - 7)
    q[:, 7:] = amplitude * np.sin(5.0 * t[:, None] + phase)
    q[:, :3] += 0.2 * np.sin(4.0 * t[:, None] + [0.0, 1.0, 2.0]) + [0.0, 0.0, 1.0]
    half = 0.2 * np.sin(3.0 * t)
    q[:, 3:7] = np.column_stack([np.cos(half), 0.6 * np.sin(half), 0.0 * t, 0.8 * np.sin(half)])
    return q

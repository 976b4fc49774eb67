"""Clothes that lag behind the body."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array32 = NDArray[np.float32]
_STEP_S = 1 / 120
_STIFFNESS_RAD_S = 26.0
_DAMPING = 0.35
_GRAVITY_M_S2 = 9.81
_JUMP_M = 0.4
"""Movement of the body between frames that restarts the cloth."""


class Cloth:
    """The clothes of one performer over one camera's frames.

    A damped spring connects every vertex to its place on the body, so the cloth lags behind sudden movements, by at
    most its looseness.

    Args:
        looseness_m: largest offset of every vertex, 0 = skin, shape (V,).
    """

    def __init__(self, looseness_m: Array32) -> None:
        self._loose = np.nonzero(looseness_m > 0)[0].astype(np.int32)
        self._room = looseness_m[self._loose]
        self._time_s: float | None = None
        self._state = np.zeros((4, len(self._loose), 3), np.float32)  # offset, place, and each one's velocity

    def follow(self, vertices: Array32, time_s: float) -> None:
        """Move the vertices of the clothes, shape (V, 3), to a time after the last one [s]."""
        if not len(self._loose):
            return
        place = vertices[self._loose]
        elapsed = 0.0 if self._time_s is None else time_s - self._time_s
        self._time_s = time_s
        if elapsed <= 0 or np.abs(place - self._state[2]).max() > _JUMP_M:
            self._state[:] = 0.0
            self._state[0, :, 2] = -_GRAVITY_M_S2 / _STIFFNESS_RAD_S**2
            self._state[2] = place
            elapsed = 0.0
        steps = max(round(elapsed / _STEP_S), 1)
        _step(self._state, place, self._room, elapsed, steps)
        vertices[self._loose] += self._state[0]


@compiled
def _step(state: Array32, place: Array32, room: Array32, elapsed: float, steps: int) -> None:
    offset, speed, old, old_speed = state[0], state[1], state[2], state[3]
    dt = elapsed / steps
    for v in range(len(place)):
        for i in range(3):
            if elapsed > 0:
                new_speed = (place[v, i] - old[v, i]) / elapsed
                pull = -(new_speed - old_speed[v, i]) / elapsed
                old_speed[v, i] = new_speed
                if i == 2:
                    pull -= _GRAVITY_M_S2
                for _ in range(steps):
                    speed[v, i] += dt * (
                        pull
                        - _STIFFNESS_RAD_S**2 * offset[v, i]
                        - 2 * _DAMPING * _STIFFNESS_RAD_S * speed[v, i]
                    )
                    offset[v, i] += dt * speed[v, i]
            old[v, i] = place[v, i]
        length = (offset[v, 0] ** 2 + offset[v, 1] ** 2 + offset[v, 2] ** 2) ** 0.5
        if length > room[v]:
            for i in range(3):
                offset[v, i] *= room[v] / length
                speed[v, i] *= 0.5

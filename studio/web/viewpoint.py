"""Where the 3D view looks from: places round the performer, going along with the performer, turning slowly."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

VIEWPOINTS = ("front", "side", "top", "orbit", "follow")
"""Places by name; `orbit` turns about the performer, `follow` goes along and lets the user turn."""

_DISTANCE_M = 4.6
_LOOK_HEIGHT_M = 0.9
_OFFSETS = {
    "front": (0.0, -_DISTANCE_M, 0.45),
    "side": (_DISTANCE_M, 0.0, 0.45),
    "top": (0.0, -0.02, 5.6),
}
_TURN_S = 24.0
_STEP_M = 0.002


class Viewpoint:
    """Moves the cameras of all browsers; call it from the drawing thread."""

    def __init__(self, server: Any) -> None:
        self._server = server
        self._mode = ""
        self._last: NDArray[np.float64] | None = None

    def choose(self, place: str) -> None:
        """Look from a place of `VIEWPOINTS` from the next `update` on."""
        self._mode, self._last = place, None

    def update(self, hips_m: NDArray[np.float64] | None, now_s: float) -> None:
        """Move the cameras; `hips_m` is where the performer is, None where there is nobody."""
        if not self._mode:
            return
        target = np.array([0.0, 0.0, _LOOK_HEIGHT_M])
        if hips_m is not None:
            target[:2] = hips_m[:2]
        if self._mode in _OFFSETS:
            self._look(target + _OFFSETS[self._mode], target)
            self._mode = ""
        elif self._mode == "orbit":
            turn = 2.0 * np.pi * now_s / _TURN_S
            offset = np.array([np.sin(turn), -np.cos(turn), 0.12]) * _DISTANCE_M
            self._look(target + offset, target)
        elif self._last is None:
            self._last = target
        elif np.linalg.norm(target - self._last) > _STEP_M:
            self._shift(target - self._last)
            self._last = target

    def _look(self, position: NDArray[np.float64], target: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.position = position
                client.camera.look_at = target

    def _shift(self, by: NDArray[np.float64]) -> None:
        for client in self._server.get_clients().values():
            position, target = client.camera.position + by, client.camera.look_at + by
            with client.atomic():
                client.camera.position = position
                client.camera.look_at = target

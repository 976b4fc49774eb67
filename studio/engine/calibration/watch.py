"""Watches during capture whether the cameras still agree, so that a bumped camera is noticed within seconds."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.steadiness import block_shifts
from studio.engine.calibration.swaps import exchange, find_swaps
from studio.engine.frames import FrameSet

ALARM_M = 0.06
"""A body that bends shows its cameras other sides: real Kinects then shift by up to 5 cm without being moved."""

_WINDOW_S = 2.0
_RATE_HZ = 15.0
_CHECKS = 2
"""A shift must be there this many times in a row, a second apart: what passes by was not a camera."""


class CameraWatch:
    """Keeps the last two seconds of all cameras' joints and compares them once a second.

    Names the camera that moved where there are three or more; of two, both have the same shift.
    """

    def __init__(self) -> None:
        self._restart((), 0)

    def _restart(self, cameras: tuple[str, ...], now_ns: int) -> None:
        self._cameras, self._last_ns, self._checked_ns = cameras, now_ns, now_ns
        self._window: list[NDArray[np.float64]] = []
        self._times_ns: list[int] = []
        self._counts = np.zeros(len(cameras), dtype=int)
        self._shifts = np.zeros(len(cameras))

    def add(self, frames: FrameSet) -> bool:
        """Take in an instant; return whether the cameras were compared again."""
        now_ns = frames.stage_time_ns
        if frames.cameras != self._cameras or now_ns < self._last_ns:
            self._restart(frames.cameras, now_ns)
        if self._times_ns and now_ns - self._last_ns < 0.99e9 / _RATE_HZ:
            return False
        self._last_ns = now_ns
        self._window.append(frames.positions)
        self._times_ns.append(now_ns)
        while now_ns - self._times_ns[0] > _WINDOW_S * 1e9:
            del self._window[0], self._times_ns[0]
        if len(self._cameras) < 2 or now_ns - self._checked_ns < 1e9:
            return False
        self._checked_ns = now_ns
        self._compare()
        return True

    def _compare(self) -> None:
        positions = np.stack(self._window, axis=1)
        swapped = find_swaps(positions)
        ordered = np.array([exchange(mine, swap) for mine, swap in zip(positions, swapped, strict=True)])
        shifts = block_shifts(ordered, ALARM_M)
        self._shifts = np.array([shifts[camera] for camera in range(len(self._cameras))])
        self._counts = np.where(self._shifts > ALARM_M, self._counts + 1, 0)

    def shifts_m(self) -> dict[str, float]:
        """Return how far each camera's joints were from the others' in the last comparison [m]."""
        return dict(zip(self._cameras, self._shifts.tolist(), strict=True))

    def moved(self) -> dict[str, float]:
        """Return the cameras whose joints have stayed away from the others', with how far [m]."""
        return {
            name: shift
            for name, shift in self.shifts_m().items()
            if self._counts[self._cameras.index(name)] >= _CHECKS
        }

"""Compares the cameras during capture, so that a bumped camera is noticed within seconds."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.cameras.swaps import exchange, find_swaps
from studio.engine.calibration.quality.steadiness import block_shifts
from studio.engine.model.frames import FrameSet

ALARM_M = 0.06
"""Alarm threshold. A body that bends shows its cameras different sides; real Kinects then shift by up to 5 cm."""

_WINDOW_S = 2.0
_RATE_HZ = 15.0
_NOW_S = 1.0
_CHECKS = 2
"""Number of successive checks, a second apart, that must show a shift for a camera to count as moved."""


class CameraWatch:
    """Keeps the last two seconds of all cameras' joints and compares them once a second.

    Of three or more cameras it names the one that moved; two have the same shift. `apart` reports all shifts at once,
    even short ones, such as those of a performer at the edge of a view; `moved` reports shifts that last for seconds.
    """

    def __init__(self) -> None:
        self._restart((), 0)

    def _restart(self, cameras: tuple[str, ...], now_ns: int) -> None:
        self._cameras, self._last_ns, self._checked_ns = cameras, now_ns, now_ns
        self._window: list[NDArray[np.float64]] = []
        self._times_ns: list[int] = []
        self._counts = np.zeros(len(cameras), dtype=int)
        self._shifts = np.zeros(len(cameras))
        self._now = np.zeros(len(cameras))

    def add(self, frames: FrameSet) -> bool:
        """Add an instant; return whether the cameras were compared again."""
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
        self._shifts = _shifts(ordered)
        recent = np.array(self._times_ns) > self._last_ns - _NOW_S * 1e9
        self._now = _shifts(ordered[:, recent])
        self._counts = np.where(self._shifts > ALARM_M, self._counts + 1, 0)

    def shifts_m(self) -> dict[str, float]:
        """Return the distance of each camera's joints from the others' in the last comparison [m]."""
        return dict(zip(self._cameras, self._shifts.tolist(), strict=True))

    def apart(self) -> dict[str, float]:
        """Return the cameras whose joints were away from the others' in the last second, with distances [m]."""
        return {
            name: float(shift)
            for name, shift in zip(self._cameras, self._now, strict=True)
            if shift > ALARM_M
        }

    def moved(self) -> dict[str, float]:
        """Return the cameras whose joints have stayed away from the others', with distances [m]."""
        return {
            name: shift
            for name, shift in self.shifts_m().items()
            if self._counts[self._cameras.index(name)] >= _CHECKS
        }


def _shifts(ordered: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each camera's shift from the others [m]; joints as for `steadiness.block_shifts`."""
    shifts = block_shifts(ordered, ALARM_M)
    return np.array([shifts[camera] for camera in range(len(ordered))])

"""Values over time: eased between keys, and walking paths of a body over the floor."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

_GRAVITY_M_S2 = 9.81
RATE_HZ = 120
"""Frame rate at which motions are composed."""


def ease(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the minimum-jerk curve from 0 to 1 as `share` goes from 0 to 1; constant outside."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


@dataclass(frozen=True)
class Jump:
    """A jump from a crouch: constant push and landing forces over `push_m`, free fall in between.

    Attributes:
        take_off_s: time at which the feet leave the floor.
        height_m: rise of the hips in flight.
        push_m: rise of the hips from the crouch to the take-off, and their descent after landing.
    """

    take_off_s: float
    height_m: float
    push_m: float

    @property
    def speed_m_s(self) -> float:
        return float(np.sqrt(2 * _GRAVITY_M_S2 * self.height_m))

    @property
    def push_s(self) -> float:
        return 2 * self.push_m / self.speed_m_s

    @property
    def flight_s(self) -> float:
        return 2 * self.speed_m_s / _GRAVITY_M_S2

    def lift(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the height of flight of the whole body [m], same shape."""
        t = np.clip(times_s - self.take_off_s, 0.0, self.flight_s)
        return self.speed_m_s * t - _GRAVITY_M_S2 / 2 * t**2

    def rise(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rise of the hips out of the crouch [m], same shape."""
        t = times_s - self.take_off_s
        push = np.clip(1 + t / self.push_s, 0.0, 1.0)
        caught = np.clip(1 - (t - self.flight_s) / self.push_s, 0.0, 1.0)
        return self.push_m * push**2 * caught**2


@dataclass
class Keys:
    """Named channels, each eased from key to key with zero speed at the keys; 0 before the first key.

    Attributes:
        channels: times [s] and values of the keys, by channel, in order of time.
        jumps: all jumps.
    """

    channels: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    jumps: list["Jump"] = field(default_factory=list)

    def move(self, start_s: float, end_s: float, **values: float) -> None:
        """Move channels from their values at `start_s` to `values` at `end_s`."""
        for name, value in values.items():
            times, course = self.channels.setdefault(name, ([0.0], [0.0]))
            if start_s < times[-1] - 1e-9:
                raise ValueError(f"channel {name}: key at {start_s} s before the last one at {times[-1]} s")
            times += [start_s, end_s]
            course += [course[-1], value]

    def sample(self, name: str, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a channel's values at `times_s`, same shape."""
        if name not in self.channels:
            return np.zeros_like(times_s)
        times, values = (np.array(column) for column in self.channels[name])
        after = np.clip(np.searchsorted(times, times_s, side="right"), 1, len(times) - 1)
        start, end = times[after - 1], times[after]
        share = (times_s - start) / np.maximum(end - start, 1e-9)
        return values[after - 1] + (values[after] - values[after - 1]) * ease(share)


@dataclass
class FloorPath:
    """A body's place over the floor and its heading. It walks straight between points and turns on the spot.

    Attributes:
        times_s, points_m, yaws: keys; yaw 0 faces -y, a positive yaw turns to the left (towards +x).
    """

    times_s: list[float] = field(default_factory=lambda: [0.0])
    points_m: list[tuple[float, float]] = field(default_factory=lambda: [(0.0, 0.0)])
    yaws: list[float] = field(default_factory=lambda: [0.0])

    @property
    def end_s(self) -> float:
        return self.times_s[-1]

    def wait(self, duration_s: float) -> None:
        """Stand for some time."""
        self._key(duration_s, self.points_m[-1], self.yaws[-1])

    def turn(self, yaw: float, duration_s: float | None = None) -> None:
        """Turn on the spot to a heading, with as many turns as `yaw` has; at about 2.2 rad/s by default."""
        angle = abs(yaw - self.yaws[-1])
        self._key(0.35 + angle / 2.2 if duration_s is None else duration_s, self.points_m[-1], yaw)

    def walk(self, points_m: Sequence[tuple[float, float]], speed_m_s: float) -> None:
        """Turn to each point by the shorter way and walk to it."""
        for point in points_m:
            way = np.subtract(point, self.points_m[-1])
            heading = float(np.arctan2(way[0], -way[1]))
            turn = (heading - self.yaws[-1] + np.pi) % (2 * np.pi) - np.pi
            if abs(turn) > 0.05:
                self.turn(self.yaws[-1] + turn)
            self._key(float(np.hypot(*way)) / speed_m_s, point, self.yaws[-1])

    def _key(self, duration_s: float, point: tuple[float, float], yaw: float) -> None:
        self.times_s.append(self.end_s + duration_s)
        self.points_m.append(point)
        self.yaws.append(yaw)

    def sample(self, times_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return smooth places on the floor [m], shape (F, 2), and headings [rad], shape (F,)."""
        points = np.array(self.points_m)
        place = np.stack([np.interp(times_s, self.times_s, points[:, i]) for i in range(2)], axis=-1)
        yaw = np.interp(times_s, self.times_s, self.yaws)
        sigma = 0.18 * RATE_HZ
        return gaussian_filter1d(place, sigma, axis=0, mode="nearest"), gaussian_filter1d(
            yaw, sigma, mode="nearest"
        )

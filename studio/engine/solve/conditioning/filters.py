"""Filters over time, one registry: `holt` (the camera SDKs'), `one_euro` (smooths slow motion more than fast).

A filter takes rows of values frame by frame. A row with NaN is unseen: it passes unchanged and restarts its filter.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.base.quaternions import normalized
from studio.engine.base.value_sentences import bad_value
from studio.engine.model.settings.settings import PLACES, add_choices


class Filter(Protocol):
    """One filter over the frames of rows of values, shape (row_count, value_count)."""

    def apply(self, values: NDArray[np.float64], dt: float) -> NDArray[np.float64]: ...


class Holt:
    """Double exponential smoothing with a trend.

    Source: Holt 1957; constants per 30 Hz frame as in the Kinect SDK's default (Azimi, "Skeletal joint
    smoothing white paper", 2012), converted to other rates.
    """

    def __init__(self, smoothing: float = 0.5, correction: float = 0.5) -> None:
        self._smoothing, self._correction = smoothing, correction
        self._level: NDArray[np.float64] | None = None
        self._trend = np.zeros(0)

    def apply(self, values: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return the smoothed rows."""
        if self._level is None:
            self._level, self._trend = values.copy(), np.zeros_like(values)
            return values
        frames = max(dt, 1e-3) * 30.0
        keep = self._smoothing**frames
        follow = 1.0 - (1.0 - self._correction) ** frames
        level = (1.0 - keep) * values + keep * (self._level + self._trend * frames)
        trend = follow * (level - self._level) / frames + (1.0 - follow) * self._trend
        anew = np.isnan(level)
        self._level = np.where(anew, values, level)
        self._trend = np.where(anew, 0.0, trend)
        return self._level


class OneEuro:
    """A low-pass filter whose cut-off frequency rises with speed.

    Source: Casiez, Roussel, Vogel, "1 € filter", CHI 2012.
    """

    def __init__(
        self, min_cutoff_hz: float = 1.5, beta: float = 6.0, derivative_cutoff_hz: float = 1.0
    ) -> None:
        self._min_cutoff_hz, self._beta, self._derivative_cutoff_hz = (
            min_cutoff_hz,
            beta,
            derivative_cutoff_hz,
        )
        self._value: NDArray[np.float64] | None = None
        self._speed = np.zeros(0)

    def apply(self, values: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return the smoothed rows; a row's cut-off depends on the length of its velocity."""
        if self._value is None:
            self._value, self._speed = values.copy(), np.zeros_like(values)
            return values
        dt = max(dt, 1e-3)
        speed = (values - self._value) / dt
        share = _share(np.array(self._derivative_cutoff_hz), dt)
        speed = self._speed + share * (speed - self._speed)
        cutoff = self._min_cutoff_hz + self._beta * np.linalg.norm(speed, axis=1, keepdims=True)
        value = self._value + _share(cutoff, dt) * (values - self._value)
        anew = np.isnan(value)
        self._value = np.where(anew, values, value)
        self._speed = np.where(anew, 0.0, speed)
        return self._value


def _share(cutoff_hz: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Weight of a new value in a first-order low-pass filter."""
    return 1.0 / (1.0 + 1.0 / (2.0 * np.pi * cutoff_hz * dt))


FILTERS: dict[str, Callable[[], Filter]] = {"holt": Holt, "one_euro": OneEuro}
"""Every filter by its name in the `smoothing` switch."""


def add_filter(name: str, make: Callable[[], Filter]) -> None:
    """Register a filter in this process, for `smoothing=<name>:before` and `:after`.

    Args:
        name: letters, digits and underscores.
        make: returns a new filter without a state.

    Raises:
        SettingsError: the name is taken or is not allowed.
    """
    if name in FILTERS or not name.isidentifier():
        raise SettingsError(bad_value("filter", repr(name), f"a name other than {', '.join(FILTERS)}"))
    add_choices("smoothing", tuple(f"{name}:{place}" for place in PLACES))
    FILTERS[name] = make


class RotationFilter:
    """Applies a filter to rotations, as quaternions with continuous signs."""

    def __init__(self, inner: Filter) -> None:
        self._inner = inner
        self._last: NDArray[np.float64] | None = None

    def apply(self, quaternions_wxyz: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return smoothed unit quaternions, shape (joint_count, 4)."""
        q = quaternions_wxyz
        if self._last is not None:
            q = np.where((q * self._last).sum(axis=1, keepdims=True) < 0, -q, q)
        self._last = q
        return normalized(self._inner.apply(q, dt))

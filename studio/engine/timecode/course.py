"""The course of timecode over time: from single readings to the timecode of every instant.

A drop-out is bridged by the clock that stamped the readings, a jump begins a new run, and an unconfirmed reading is
left out. Where timecode runs faster or slower than that clock, the course follows it and gives the drift.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.engine.timecode.timecode import Timecode, TimecodeRate

_WITHIN_FRAMES, _WITHIN_PPM = 1.0, 500.0
"""Largest distance of a reading that continues a run from the run's prediction, and its growth over a gap."""

_CONFIRMED = 3
"""Number of consecutive readings that agree and so make a new run."""

_DELAYED_S = 1.0
"""Readings that a busy machine receives late look as if timecode had gone back a little. If it goes back by less than
this, a new run needs readings that agree for this long."""

_SMOOTH_S = 0.5
"""Readings this near to another are averaged with it, because packets and MIDI arrive unevenly."""

_DRIFT_S = 10.0
"""Shortest run whose drift is estimated."""

_MISSING_FRAMES = 1.75
"""Readings further apart are a drop-out."""


@dataclass(frozen=True)
class TimecodeRun:
    """Readings that one start of timecode explains.

    Attributes:
        time_s: of each reading, shape (n,) [s].
        late: frame of each, less the frames since time 0 at the rate, continuous over midnight and smoothed, shape
            (n,).
        drift_ppm: drift of timecode against the clock, positive = faster; None = the run is too short.
    """

    time_s: NDArray[np.float64]
    late: NDArray[np.float64]
    drift_ppm: float | None


@dataclass(frozen=True)
class TimecodeCourse:
    """The timecode of every instant.

    Attributes:
        rate: of the timecode.
        source: its source, such as `ltc`, `clock`; "" = counted from its start, so that nothing is missing.
        time_s: of each reading, increasing, shape (n,) [s].
        frame: of each reading, since midnight, shape (n,).
    """

    rate: TimecodeRate
    source: str
    time_s: NDArray[np.float64]
    frame: NDArray[np.int64]

    @cached_property
    def runs(self) -> list[TimecodeRun]:
        """The runs in order of time; none without readings that agree."""
        late = self.frame - self.time_s * self.rate.fps
        return [self._run(late, chosen) for chosen in _members(self.time_s, late, self.rate)]

    def _run(self, late: NDArray[np.float64], chosen: list[int]) -> TimecodeRun:
        time_s, day = self.time_s[chosen], self.rate.day
        mine = late[chosen]
        mine = mine[0] + np.cumsum(np.concatenate([[0.0], _centred(np.diff(mine), day)]))
        drift = None
        if time_s[-1] - time_s[0] >= _DRIFT_S:
            slope = np.polyfit(time_s - time_s[0], mine, 1)[0]
            drift = float(slope / self.rate.fps * 1e6)
        return TimecodeRun(time_s, _smooth(time_s, mine), drift)

    @property
    def drift_ppm(self) -> float | None:
        """Drift of timecode against the clock in the longest run, positive = faster; None = no run is long enough."""
        told = [run for run in self.runs if run.drift_ppm is not None]
        return max(told, key=lambda run: run.time_s[-1] - run.time_s[0]).drift_ppm if told else None

    def frames_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the timecode at these times as fractional frames since midnight, shape (n,).

        Between runs and after the last one, the earlier run continues; before the first, that one is extended back.

        Raises:
            ValueError: there is no run.
        """
        if not self.runs:
            raise ValueError("a course of timecode without a run")
        times = np.asarray(time_s, np.float64)
        begins = np.array([run.time_s[0] for run in self.runs[1:]])
        of_run = np.searchsorted(begins, times, side="right")
        late = np.empty(len(times))
        for number, run in enumerate(self.runs):
            mine = of_run == number
            late[mine] = _going_on(run, times[mine], self.rate.fps)
        return np.mod(times * self.rate.fps + late, self.rate.day)

    def timecodes_at(self, time_s: NDArray[np.float64]) -> list[Timecode]:
        """Return the timecode that runs at each of these times; within a tenth of a frame the next one counts."""
        return [Timecode(int(np.floor(frame + 0.1)), self.rate) for frame in self.frames_at(time_s)]

    def bridged_at(self, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether timecode was missing at each time, so that the clock bridges it, shape (n,)."""
        if not self.source:
            return np.zeros(len(time_s), bool)
        known = np.concatenate([run.time_s for run in self.runs]) if self.runs else np.empty(0)
        length_s = _MISSING_FRAMES * self.rate.ltc_frames / self.rate.fps
        if not len(known):
            return np.ones(len(time_s), bool)
        at = np.searchsorted(known, time_s + 1e-9, side="right")
        before = np.where(at > 0, known[np.maximum(at - 1, 0)], -np.inf)
        return np.asarray(time_s - before > np.maximum(length_s, self._spacing_s * 1.5))

    @cached_property
    def _spacing_s(self) -> float:
        """Usual time between readings [s]; a source may send fewer than one per frame."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 0.0

    def gaps_s(self) -> list[tuple[float, float]]:
        """Return the spans that were bridged, between readings [s]."""
        known = np.concatenate([run.time_s for run in self.runs]) if self.runs else np.empty(0)
        usual = max(_MISSING_FRAMES * self.rate.ltc_frames / self.rate.fps, 1.5 * self._spacing_s)
        return [(float(known[k]), float(known[k + 1])) for k in np.flatnonzero(np.diff(known) > usual)]

    def jumps(self) -> list[tuple[float, Timecode, Timecode]]:
        """Return the jumps: time [s], the expected timecode, and the actual one."""
        found = []
        for before, after in zip(self.runs, self.runs[1:], strict=False):
            time_s = np.array([after.time_s[0]])
            frames = [
                int(np.floor(time_s[0] * self.rate.fps + _going_on(run, time_s, self.rate.fps)[0] + 0.1))
                for run in (before, after)
            ]
            found.append((float(time_s[0]), Timecode(frames[0], self.rate), Timecode(frames[1], self.rate)))
        return found

    def times_of(self, timecode: Timecode, begins_s: float, ends_s: float) -> list[float]:
        """Return the times at which this timecode began within a span, in order [s]: none, one, or more after jumps
        back."""
        found = []
        for number, run in enumerate(self.runs):
            begins = begins_s if number == 0 else run.time_s[0]
            ends = ends_s if number + 1 == len(self.runs) else self.runs[number + 1].time_s[0]
            day = self.rate.day
            middle = 0.5 * (run.time_s[0] + run.time_s[-1])
            here = middle * self.rate.fps + _going_on(run, np.array([middle]), self.rate.fps)[0]
            time_s = middle + _centred(timecode.frame - here, day) / self.rate.fps
            for _ in range(3):  # the drift changes the result only a little
                late = _going_on(run, np.array([time_s]), self.rate.fps)[0]
                time_s += float(_centred(timecode.frame - time_s * self.rate.fps - late, day)) / self.rate.fps
            near_s = 0.5 / self.rate.fps
            if max(begins, begins_s) <= time_s + near_s and time_s - near_s < min(ends, ends_s):
                found.append(float(time_s))
        return found


def course(readings: Sequence[tuple[float, int]], rate: TimecodeRate, source: str = "") -> TimecodeCourse:
    """Return the course of readings (time [s], frame since midnight), in any order."""
    ordered = sorted(readings)
    times = np.array([time for time, _ in ordered], np.float64)
    return TimecodeCourse(rate, source, times, np.array([frame for _, frame in ordered], np.int64))


def counted_from(timecode: Timecode, time_s: float) -> TimecodeCourse:
    """Return the course of a timecode at a time [s], counted forwards and backwards by the clock."""
    steps = np.arange(_CONFIRMED)
    rate = timecode.rate
    return TimecodeCourse(rate, "", time_s + steps / rate.fps, (timecode.frame + steps) % rate.day)


def _centred(frames: NDArray[np.float64] | float, day: int) -> NDArray[np.float64]:
    """Return differences of frames, wrapped to -day/2 to day/2."""
    return np.asarray(np.mod(np.asarray(frames) + day / 2, day) - day / 2)


def _members(time_s: NDArray[np.float64], late: NDArray[np.float64], rate: TimecodeRate) -> list[list[int]]:
    """Return the readings of each run, by number."""
    runs: list[list[int]] = []
    waiting: list[int] = []
    for k in range(len(time_s)):
        if runs and _continues(runs[-1][-1], k, time_s, late, rate):
            runs[-1].append(k)
            waiting = []
            continue
        waiting = [one for one in waiting if _continues(one, k, time_s, late, rate)] + [k]
        forward = float(_centred(late[k] - late[runs[-1][-1]], rate.day)) if runs else 0.0
        needed_s = _DELAYED_S if -_DELAYED_S * rate.fps < forward < 0.0 else 0.0
        if len(waiting) >= _CONFIRMED and time_s[k] - time_s[waiting[0]] >= needed_s:
            runs.append(waiting)
            waiting = []
    return runs


def _continues(
    a: int, b: int, time_s: NDArray[np.float64], late: NDArray[np.float64], rate: TimecodeRate
) -> bool:
    within = _WITHIN_FRAMES * rate.ltc_frames + _WITHIN_PPM * 1e-6 * rate.fps * (time_s[b] - time_s[a])
    return bool(abs(_centred(late[b] - late[a], rate.day)) <= within)


def _smooth(time_s: NDArray[np.float64], late: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean of the readings near each one, as many before it as after it, shape (n,)."""
    sums = np.concatenate([[0.0], np.cumsum(late - late[0])])
    numbers = np.arange(len(late))
    first = np.searchsorted(time_s, time_s - _SMOOTH_S)
    last = np.searchsorted(time_s, time_s + _SMOOTH_S, side="right") - 1
    reach = np.minimum(numbers - first, last - numbers)
    return late[0] + (sums[numbers + reach + 1] - sums[numbers - reach]) / (2 * reach + 1)


def _going_on(run: TimecodeRun, time_s: NDArray[np.float64], fps: float) -> NDArray[np.float64]:
    """Return `late` of a run at any times: between its readings, and with its drift beyond them."""
    slope = 0.0 if run.drift_ppm is None else run.drift_ppm * 1e-6 * fps
    beyond = np.minimum(time_s - run.time_s[0], 0.0) + np.maximum(time_s - run.time_s[-1], 0.0)
    return np.interp(time_s, run.time_s, run.late) + slope * beyond

"""Exchange of two performers from a moment on, where an operator saw that their identities were swapped."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

from studio.engine.identity.whole_take import People, TakePerformer
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.on_demand import FramesOnDemand
from studio.engine.model.performers.exchange import Exchange

_Spans = tuple[tuple[float, float], ...]


def exchanged(
    people: People, calibration: Calibration, exchanges: Sequence[Exchange]
) -> tuple[People, list[Exchange]]:
    """Return the performers with their frames exchanged, and the exchanges that were made.

    Each is applied to the result of those before it, as an operator makes them. An exchange of a performer who was
    not found is left out. Names and proportions stay.

    Args:
        people: everybody in a take.
        calibration: has the cameras' clocks.
        exchanges: in the order in which they were requested.
    """
    found = {one.name: one for one in people.performers}
    made = []
    for exchange in exchanges:
        first, second = exchange.performers
        if first in found and second in found:
            one, other = found[first], found[second]
            found[first] = _continued(one, other, calibration, exchange.time_s)
            found[second] = _continued(other, one, calibration, exchange.time_s)
            made.append(exchange)
    return replace(people, performers=tuple(found.values())), made


def _continued(
    one: TakePerformer, other: TakePerformer, calibration: Calibration, time_s: float
) -> TakePerformer:
    """Return a performer who continues as another from a time on."""
    return replace(
        one,
        frames={
            name: _Spliced(
                one.frames.get(name, ()), other.frames.get(name, ()), _Clock(calibration, name), time_s
            )
            for name in {**one.frames, **other.frames}
        },
        undecided_s=(*_before(one.undecided_s, time_s), *_after(other.undecided_s, time_s)),
    )


def _before(spans: _Spans, time_s: float) -> _Spans:
    return tuple((begin, min(end, time_s)) for begin, end in spans if begin < time_s)


def _after(spans: _Spans, time_s: float) -> _Spans:
    return tuple((max(begin, time_s), end) for begin, end in spans if end >= time_s)


class _Clock:
    """Gives the stage time of a camera's frames [s]."""

    def __init__(self, calibration: Calibration, camera: str) -> None:
        self._clock = calibration.cameras[camera].clock

    def __call__(self, frame: CameraFrame) -> float:
        return self._clock.stage_ns(frame.device_time_ns) * 1e-9


class _Spliced(FramesOnDemand):
    """A camera's frames of one performer before a time, and of another from it on."""

    def __init__(
        self, first: Sequence[CameraFrame], second: Sequence[CameraFrame], stage_s: _Clock, time_s: float
    ) -> None:
        self._first, self._second = first, second
        self._until = bisect_left(first, time_s, key=stage_s)
        self._since = bisect_left(second, time_s, key=stage_s)

    def __len__(self) -> int:
        return self._until + len(self._second) - self._since

    def at(self, index: int) -> CameraFrame:
        if index < self._until:
            return self._first[index]
        return self._second[index - self._until + self._since]

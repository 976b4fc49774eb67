"""Time spans of moments that follow each other closely, such as those at which two persons were not told apart."""

from collections.abc import Sequence

_CLOSE_S = 0.1


def spans(times_s: Sequence[float], least: int) -> tuple[tuple[float, float], ...]:
    """Return the spans in which at least `least` times follow each other closely."""
    spans: list[list[float]] = []
    for time_s in times_s:
        if spans and time_s - spans[-1][1] < _CLOSE_S:
            spans[-1][1:] = [time_s, spans[-1][2] + 1]
        else:
            spans.append([time_s, time_s, 1])
    return tuple((begin, end) for begin, end, count in spans if count >= least)

"""Timecodes of video files as times of the day (SMPTE ST 12-1)."""

import re

from studio.engine.timecode.timecode import DAY_S, TimecodeRate

_FORM = re.compile(r"(\d{2}):(\d{2}):(\d{2})([:;.,])(\d{2,3})")
_RATES = (24, 25, 30, 48, 50, 60, 100, 120, 240)
_NEAR = 0.015
"""Maximum distance of a video's average rate from a usual one, as a share; its frames may come unevenly."""


def seconds_of(timecode: str, frames_per_second: float) -> float | None:
    """Return the time of the day of a timecode [s]; None if it is invalid at this rate.

    Rates such as 29.97 count whole frames of 30: without drop-frame their second is a little longer than a second.
    Drop-frame (`;`) leaves out two numbers a minute (four at 59.94), except in every tenth.

    Args:
        timecode: `hh:mm:ss:ff`, with `;` before the frames for drop-frame.
        frames_per_second: of the pictures.
    """
    found = _FORM.fullmatch(timecode.strip())
    if found is None:
        return None
    hours, minutes, seconds, frames = (int(found.group(k)) for k in (1, 2, 3, 5))
    exact, rate = min(
        ((one * share, one) for one in _RATES for share in (1.0, 1000 / 1001)),
        key=lambda usual: abs(usual[0] - frames_per_second),
    )
    if abs(exact - frames_per_second) > _NEAR * rate:
        return None
    if hours > 23 or minutes > 59 or seconds > 59 or frames >= rate:
        return None
    of_file = TimecodeRate(rate, ntsc=exact != rate, drop=found.group(4) in ";,")
    return of_file.number(hours, minutes, seconds, frames) / exact


def apart_s(first: float, second: float) -> float:
    """Return how much later the second of two times of the day is [s], also over midnight; -12 to 12 hours."""
    return (second - first + DAY_S / 2) % DAY_S - DAY_S / 2

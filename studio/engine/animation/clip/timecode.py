"""Times of day as hh:mm:ss:ff, where ff counts frames."""

import re

from studio.engine.base.errors import SettingsError

_TIMECODE = re.compile(r"(\d{2}):(\d{2}):(\d{2}):(\d{2,3})")


def timecode_seconds(timecode: str, frames_per_second: float) -> float:
    """Return a timecode as seconds since midnight, exact to the frame.

    Frames count at the whole rate next to `frames_per_second` (30 for 29.97), without dropped numbers.

    Raises:
        SettingsError: the form is not hh:mm:ss:ff, or a number is too large for a day or a second.
    """
    match = _TIMECODE.fullmatch(timecode)
    if match is None:
        raise SettingsError(
            "export.timecode",
            "timecode={timecode}: allowed is hh:mm:ss:ff, such as 09:30:00:00",
            timecode=timecode,
        )
    hours, minutes, seconds, frames = map(int, match.groups())
    whole = max(1, round(frames_per_second))
    if hours > 23 or minutes > 59 or seconds > 59 or frames >= whole:
        raise SettingsError(
            "export.timecode_range",
            "timecode={timecode}: allowed is 00:00:00:00 to 23:59:59:{frame} at {rate} frames a second",
            timecode=timecode,
            frame=f"{whole - 1:02d}",
            rate=whole,
        )
    return (((hours * 60 + minutes) * 60 + seconds) * whole + frames) / frames_per_second

"""The timecode of a take in `timecode.npz`: the readings received during it, on the stage clock.

It is derived from the events `timecode` of the live log, and made from them again if the file is missing.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import damaged
from studio.engine.base.files import write_atomically
from studio.engine.base.versions import TIMECODE
from studio.engine.model.frames import ClockModel
from studio.engine.timecode.course import TimecodeCourse, counted_from, course
from studio.engine.timecode.timecode import RATES, Timecode, rate_named
from studio.take.folder.take import Take
from studio.take.raw.live_log import LiveEvent, StageClockEvent, TimecodeEvent
from studio.take.raw.reader import RawReader
from studio.take.raw.records import RawEvent

FILE = "timecode.npz"
_OF_DAY = RATES["60"]
"""Rate of `timecode` in `take.json`, the time of the day at its start."""


def stage_course(
    events: Iterable[tuple[int, LiveEvent]], server_to_stage: ClockModel | None
) -> TimecodeCourse | None:
    """Return the course of timecode events at times of the server's clock [ns]; None if there is none to place.

    If there are several rates, that of the first event counts.
    """
    told = [(time_ns, event) for time_ns, event in events if isinstance(event, TimecodeEvent)]
    if not told or server_to_stage is None or told[0][1].rate not in RATES:
        return None
    first = told[0][1]
    readings = [
        (server_to_stage.stage_ns(time_ns) * 1e-9, event.frame)
        for time_ns, event in told
        if (event.rate, event.source) == (first.rate, first.source)
    ]
    return course(readings, rate_named(first.rate), first.source)


def save_course(take: Take, path: TimecodeCourse) -> None:
    """Write the course into the take.

    Raises:
        StudioError: the disk refuses.
    """
    arrays = {
        "rate": np.array(path.rate.name),
        "source": np.array(path.source),
        "time_s": path.time_s,
        "frame": path.frame,
    }
    with write_atomically(take.path / FILE) as file:
        save_arrays(file, arrays, TIMECODE)


def take_course(take: Take, begins_s: float) -> TimecodeCourse | None:
    """Return the timecode of a take over its stage time; None where it has none.

    A take that was recorded without timecode has the time of the day at its start, counted on at 60 frames a second.

    Args:
        take: of any kind.
        begins_s: stage time of its first pose [s].

    Raises:
        FormatError: the file is damaged.
    """
    if (take.path / FILE).is_file():
        found = _load(take.path / FILE)
    elif "timecode_rate" in take.meta and take.raw_path.is_file():
        found = _logged(take.raw_path)
    else:
        found = None
    if found is not None and found.runs:
        return found
    text = take.meta.get("timecode")
    return None if text is None else counted_from(Timecode.parse(text, _OF_DAY), begins_s)


def _load(path: Path) -> TimecodeCourse:
    try:
        values = read_arrays(path, ("rate", "source", "time_s", "frame"), TIMECODE)
        rate = rate_named(str(values["rate"]))
        time_s, frame = values["time_s"].astype(np.float64), values["frame"].astype(np.int64)
        if time_s.ndim != 1 or time_s.shape != frame.shape or not np.isfinite(time_s).all():
            raise ValueError("its times and frames do not fit")
    except FormatError:
        raise
    except Exception as error:  # zipfile and zlib raise their own errors for a truncated file
        raise FormatError(damaged(path, error)) from error
    order = np.argsort(time_s, kind="stable")
    return TimecodeCourse(rate, str(values["source"]), time_s[order], frame[order])


def _logged(raw: Path) -> TimecodeCourse | None:
    """Return the course in the live log of a take whose end was lost."""
    events = [(one.time_ns, one.event) for one in RawReader(raw) if isinstance(one, RawEvent)]
    clocks = [event.model for _, event in events if isinstance(event, StageClockEvent)]
    return stage_course(events, clocks[-1] if clocks else None)

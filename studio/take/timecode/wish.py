"""Requests of an export for timecode: the timecode of its file, and the part of the take by timecode."""

from dataclasses import dataclass, replace

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.base.errors import SettingsError
from studio.engine.timecode.course import TimecodeCourse, counted_from
from studio.engine.timecode.timecode import RATES, Timecode, TimecodeRate, rate_named
from studio.take.folder.take import Take
from studio.take.timecode.kept import take_course

OF_TAKE = "take"


@dataclass(frozen=True)
class TimecodeWish:
    """Timecode of an export.

    Attributes:
        timecode: of the take's first frame, or `take`: the take's own; None = the file has none.
        rate: of `timecode`; None = the file's frame rate.
        begins, ends: the part of the take, by the take's own timecode; None = from the start, to the end.
    """

    timecode: str | None = None
    rate: str | None = None
    begins: str | None = None
    ends: str | None = None

    def of(
        self, take: Take, options: ExportOptions, *, begins_s: float, ends_s: float, fps: float
    ) -> ExportOptions:
        """Return the options with the timecode of every frame, and the part [s].

        Args:
            take: to export.
            options: without timecode.
            begins_s, ends_s: stage times of the solve's first and last frame [s].
            fps: frame rate of the file [Hz].

        Raises:
            SettingsError: the take has no timecode, a timecode that does not exist, or a part outside the take.
        """
        own = None
        if self.timecode == OF_TAKE or self.begins is not None or self.ends is not None:
            own = take_course(take, begins_s)
            if own is None:
                raise SettingsError(
                    "export.take_no_timecode",
                    "timecode=take: take {take} has none; give it as hh:mm:ss:ff",
                    take=take.path,
                )
        if own is not None:
            options = self._part(own, options, begins_s, ends_s)
        if self.timecode is None:
            return options
        if own is not None and self.timecode == OF_TAKE:
            return replace(options, timecodes=own)
        rate = _rate(self.rate, fps)
        if rate is None:
            return replace(options, timecode=self.timecode)
        return replace(options, timecodes=counted_from(Timecode.parse(self.timecode, rate), begins_s))

    def _part(
        self, own: TimecodeCourse, options: ExportOptions, begins_s: float, ends_s: float
    ) -> ExportOptions:
        start_s, end_s = options.start_s, options.end_s
        if self.begins is not None:
            start_s = _when(own, "from", self.begins, begins_s, ends_s) - begins_s
        if self.ends is not None:
            end_s = _when(own, "to", self.ends, begins_s, ends_s) - begins_s
        return replace(
            options,
            start_s=None if start_s is None else max(0.0, start_s),
            end_s=None if end_s is None else max(0.0, end_s),
        )


def _rate(name: str | None, fps: float) -> TimecodeRate | None:
    """Return the rate of a name, or that of a file's frame rate; None where timecode knows no such rate."""
    if name is not None:
        return rate_named(name)
    return next((one for one in RATES.values() if not one.drop and abs(one.fps - fps) < 0.005), None)


def _when(own: TimecodeCourse, option: str, text: str, begins_s: float, ends_s: float) -> float:
    """Return the stage time at which a timecode begins in the take [s]: the first of several."""
    wanted = Timecode.parse(text, own.rate)
    found = own.times_of(wanted, begins_s, ends_s + 1.0 / own.rate.fps)
    if not found:
        first, last = (own.timecodes_at(own.time_s[:1] * 0 + time)[0] for time in (begins_s, ends_s))
        raise SettingsError(
            "export.timecode_part",
            "{option}={timecode}: the take runs from {first} to {last}",
            option=option,
            timecode=text,
            first=str(first),
            last=str(last),
        )
    return found[0]

"""Timecode: the number of a frame within the day, and its text hh:mm:ss:ff, at the rates of film and television.

Source: SMPTE ST 12-1:2014, "Time and Control Code". Drop-frame skips the first numbers of each minute except every
tenth: two at 29.97, four at 59.94. Only numbers are skipped, no frames.
"""

import re
from dataclasses import dataclass
from fractions import Fraction

from studio.engine.base.errors import SettingsError

DAY_S = 86_400
_FORM = re.compile(r"(\d{2}):(\d{2}):(\d{2})([:;.,])(\d{2,3})")


@dataclass(frozen=True)
class TimecodeRate:
    """A rate of timecode.

    Attributes:
        count: numbers in a second, such as 30 of 29.97.
        ntsc: frames come at 1000/1001 of `count` a second.
        drop: drop-frame.
    """

    count: int
    ntsc: bool = False
    drop: bool = False

    @property
    def exact(self) -> Fraction:
        """Frames a second."""
        return Fraction(self.count * 1000, 1001) if self.ntsc else Fraction(self.count)

    @property
    def fps(self) -> float:
        """Frames a second, as a float."""
        return float(self.exact)

    @property
    def day(self) -> int:
        """Numbers in 24 hours of timecode."""
        return DAY_S * self.count - self._dropped(24 * 60)

    @property
    def name(self) -> str:
        """As in `RATES`: 25, 23.976, 29.97, 29.97df."""
        return f"{self.fps:.5g}" + ("df" if self.drop else "")

    @property
    def ltc_frames(self) -> int:
        """Frames that a word of LTC or MTC stands for: above 30 a second in pairs (ST 12-1, 12.1)."""
        return 1 if self.count <= 30 else 2

    def _dropped(self, minutes: int) -> int:
        """Numbers left out up to the start of a minute of the day."""
        return self.count // 15 * (minutes - minutes // 10) if self.drop else 0

    def frame(self, hours: int, minutes: int, seconds: int, frames: int) -> int | None:
        """Return the frame of these numbers, counted from midnight; None where there is no such number."""
        if not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= seconds < 60 and 0 <= frames < self.count):
            return None
        if self.drop and minutes % 10 and seconds == 0 and frames < self.count // 15:
            return None
        return self.number(hours, minutes, seconds, frames)

    def number(self, hours: int, minutes: int, seconds: int, frames: int) -> int:
        """Return the frame of these numbers, counted from midnight, also of those that drop-frame leaves out."""
        whole = hours * 60 + minutes
        return (whole * 60 + seconds) * self.count + frames - self._dropped(whole)


_ALL = (
    TimecodeRate(24, ntsc=True), TimecodeRate(24), TimecodeRate(25),
    TimecodeRate(30, ntsc=True, drop=True), TimecodeRate(30, ntsc=True), TimecodeRate(30),
    TimecodeRate(48, ntsc=True), TimecodeRate(48), TimecodeRate(50),
    TimecodeRate(60, ntsc=True, drop=True), TimecodeRate(60, ntsc=True), TimecodeRate(60),
)  # fmt: skip
RATES: dict[str, TimecodeRate] = {one.name: one for one in _ALL}
"""Name -> rate: 23.976, 24, 25, 29.97df, 29.97, 30, 47.952, 48, 50, 59.94df, 59.94, 60."""


def rate_named(name: str) -> TimecodeRate:
    """Return the rate of a name.

    Raises:
        SettingsError: there is none.
    """
    if name not in RATES:
        raise SettingsError(
            "timecode.rate",
            "timecode rate {rate} is not allowed; allowed: {rates}",
            rate=name[:40],
            rates=[*RATES],
        )
    return RATES[name]


@dataclass(frozen=True)
class Timecode:
    """A frame's number.

    Attributes:
        frame: counted from midnight; it wraps at `rate.day`.
        rate: of the timecode.
    """

    frame: int
    rate: TimecodeRate

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame", self.frame % self.rate.day)

    @classmethod
    def parse(cls, text: str, rate: TimecodeRate) -> "Timecode":
        """Return the timecode of a text; any of `: ; . ,` may precede the frames, because the rate sets drop-frame.

        Raises:
            SettingsError: it is none, or a number that the rate does not have, such as one left out by drop-frame.
        """
        found = _FORM.fullmatch(text.strip())
        frame = None if found is None else rate.frame(*(int(found.group(k)) for k in (1, 2, 3, 5)))
        if frame is None:
            raise SettingsError(
                "timecode.text",
                "timecode {timecode} is not allowed at {rate}; allowed: hh:mm:ss:ff of a number that exists, "
                "such as {example}",
                timecode=text[:40],
                rate=rate.name,
                example=str(cls(rate.count * 3600, rate)),
            )
        return cls(frame, rate)

    @property
    def parts(self) -> tuple[int, int, int, int]:
        """Hours, minutes, seconds, frames."""
        number, rate = self.frame, self.rate
        if rate.drop:
            dropped = rate.count // 15
            minute = 60 * rate.count - dropped
            tens, rest = divmod(number, 10 * minute + dropped)
            number += 9 * dropped * tens + dropped * max(0, (rest - dropped) // minute)
        seconds, frames = divmod(number, rate.count)
        return seconds // 3600, seconds // 60 % 60, seconds % 60, frames

    @property
    def seconds(self) -> float:
        """Real time since midnight's number [s]: frames by the exact rate."""
        return float(self.frame / self.rate.exact)

    def __str__(self) -> str:
        hours, minutes, seconds, frames = self.parts
        return f"{hours:02d}:{minutes:02d}:{seconds:02d}{';' if self.rate.drop else ':'}{frames:02d}"

    def __add__(self, frames: int) -> "Timecode":
        return Timecode(self.frame + frames, self.rate)


def at_seconds(seconds: float, rate: TimecodeRate) -> Timecode:
    """Return the timecode with the hours, minutes and seconds of a time of the day [s], from which a clock starts."""
    if rate.ntsc and not rate.drop:  # counted from midnight it would be late by 3.6 s an hour
        whole = int(seconds // 1)
        return Timecode(whole * rate.count + int((seconds - whole) * rate.fps), rate)
    return Timecode(int(seconds * rate.exact), rate)

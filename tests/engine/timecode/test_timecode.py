"""Numbers of timecode against facts from SMPTE ST 12-1 and against independent arithmetic."""

import pytest

from studio.engine.base.errors import SettingsError
from studio.engine.timecode.timecode import RATES, Timecode, at_seconds


def test_the_rates():
    assert list(RATES) == [
        "23.976", "24", "25", "29.97df", "29.97", "30", "47.952", "48", "50", "59.94df", "59.94", "60"
    ]  # fmt: skip
    assert RATES["23.976"].fps == 24000 / 1001 and RATES["59.94df"].fps == 60000 / 1001


@pytest.mark.parametrize(
    ("rate", "text", "frame"),
    [
        # ST 12-1 and its handbooks: 17,982 frames in ten minutes, 107,892 in an hour, 2,589,408 in a day
        ("29.97df", "00:00:59;29", 1799), ("29.97df", "00:01:00;02", 1800), ("29.97df", "00:09:59;29", 17981),
        ("29.97df", "00:10:00;00", 17982), ("29.97df", "01:00:00;00", 107892), ("29.97df", "23:59:59;29", 2589407),
        ("29.97", "00:01:00:00", 1800), ("29.97", "01:00:00:00", 108000),
        ("59.94df", "00:00:59;59", 3599), ("59.94df", "00:01:00;04", 3600), ("59.94df", "00:10:00;00", 35964),
        ("25", "10:00:00:00", 900_000), ("24", "23:59:59:23", 2_073_599), ("50", "00:00:01:49", 99),
    ],
)  # fmt: skip
def test_known_numbers(rate, text, frame):
    assert Timecode.parse(text, RATES[rate]).frame == frame
    assert str(Timecode(frame, RATES[rate])) == text


@pytest.mark.parametrize("name", RATES)
def test_every_number_of_an_hour_follows_the_one_before(name):
    """Counted like a clock: by carrying, and by skipping the numbers that drop-frame leaves out."""
    rate = RATES[name]
    h, m, s, f = 9, 59, 0, 0
    frame = rate.frame(h, m, s, f) or rate.frame(h, m, s, f := rate.count // 15)
    for number in range(frame, frame + rate.count * 60 * 12):
        assert Timecode(number, rate).parts == (h, m, s, f)
        assert rate.frame(h, m, s, f) == number
        f += 1
        if f == rate.count:
            f, s = 0, s + 1
        if s == 60:
            s, m = 0, m + 1
        if m == 60:
            m, h = 0, h + 1
        if rate.drop and s == 0 and f == 0 and m % 10:
            f = rate.count // 15


@pytest.mark.parametrize("name", RATES)
def test_midnight(name):
    rate = RATES[name]
    assert str(Timecode(rate.day - 1, rate) + 1).replace(";", ":") == "00:00:00:00"
    assert Timecode(0, rate) + -1 == Timecode(rate.day - 1, rate)


def test_drop_frame_follows_the_clock():
    """A day of 29.97 drop-frame ends 86 ms early; without drop-frame it would take 86.4 s longer than a day."""
    assert RATES["29.97df"].day / RATES["29.97df"].fps == pytest.approx(86400 - 0.0864, abs=1e-6)
    assert Timecode.parse("23:59:59:29", RATES["29.97"]).seconds == pytest.approx(86486.4, abs=0.04)


@pytest.mark.parametrize(
    ("text", "rate"),
    [("00:01:00;00", "29.97df"), ("00:01:00;03", "59.94df"), ("24:00:00:00", "25"), ("00:00:00:25", "25"),
     ("1:00:00:00", "25"), ("", "25"), ("00:61:00:00", "25")],
)  # fmt: skip
def test_what_is_no_timecode(text, rate):
    with pytest.raises(SettingsError, match="not allowed at"):
        Timecode.parse(text, RATES[rate])


@pytest.mark.parametrize("name", RATES)
def test_a_clock_starts_at_the_time_of_day(name):
    for seconds in (0.0, 3661.5, 40_000.25, 86_399.9):
        h, m, s, _ = at_seconds(seconds, RATES[name]).parts
        assert abs(h * 3600 + m * 60 + s - seconds) < 1.1

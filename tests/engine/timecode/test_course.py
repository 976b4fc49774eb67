"""The course of timecode: drop-outs, jumps, single wrong readings, and conversion from a timecode back to a time."""

import numpy as np
import pytest

from studio.engine.timecode.course import course
from studio.engine.timecode.timecode import RATES, Timecode


def readings(first, begin_s, count, rate, ppm=0.0):
    return [(begin_s + k / rate.fps / (1 + ppm * 1e-6), (first + k) % rate.day) for k in range(count)]


@pytest.mark.parametrize("name", RATES)
def test_a_long_drop_out_is_bridged_with_the_drift(name):
    rate, ppm = RATES[name], 50.0
    whole = readings(rate.day - 100, 3.0, int(rate.fps * 600), rate, ppm)
    kept = [one for one in whole if not 100.0 < one[0] < 500.0]
    path = course(kept, rate, "ltc")
    assert len(path.runs) == 1 and not path.jumps()
    times = np.array([time for time, _ in whole])
    said = np.array([one.frame for one in path.timecodes_at(times + 0.3 / rate.fps)])
    assert np.array_equal(said, [frame for _, frame in whole])
    assert path.drift_ppm == pytest.approx(ppm, abs=0.5)
    assert [round(end - begin) for begin, end in path.gaps_s()] == [400]
    bridged = path.bridged_at(times)
    assert bridged[(times > 100.2) & (times < 500)].all() and not bridged[times < 100].any()


def test_one_wrong_reading_is_no_jump():
    rate = RATES["25"]
    given = readings(1000, 0.0, 100, rate)
    given[40] = (given[40][0], 777_777)
    given[60:62] = [(given[60][0], 5), (given[61][0], 999)]
    path = course(given, rate)
    assert len(path.runs) == 1
    assert [one.frame for one in path.timecodes_at(np.array([1.61, 2.41]))] == [1040, 1060]


def test_jumps_forward_and_back():
    rate = RATES["29.97df"]
    given = readings(1000, 0.0, 90, rate) + readings(50_000, 90 / rate.fps, 90, rate)
    given += readings(1000, 180 / rate.fps, 90, rate)
    path = course(given, rate)
    assert [(before.frame, after.frame) for _, before, after in path.jumps()] == [
        (1090, 50_000),
        (50_090, 1000),
    ]
    assert [round(time * rate.fps) for time in path.times_of(Timecode(1010, rate), 0.0, 9.1)] == [10, 190]
    assert [round(time * rate.fps) for time in path.times_of(Timecode(50_030, rate), 0.0, 9.1)] == [120]
    assert path.times_of(Timecode(80_000, rate), 0.0, 9.1) == []


def test_readings_that_a_busy_machine_took_in_late_are_no_jumps():
    rate = RATES["25"]
    given = readings(1000, 0.0, 200, rate)
    woke_s = given[70][0]
    given[50:70] = [(woke_s, frame) for _, frame in given[50:70]]  # all at once, after 0.8 s
    given[120:130] = [(time + 0.06, frame) for time, frame in given[120:130]]
    path = course(given, rate)
    assert len(path.runs) == 1
    assert [one.frame for one in path.timecodes_at(np.array([1.41, 5.01]))] == [1035, 1125]
    assert path.frames_at(np.array([2.4])) == pytest.approx(1060, abs=1.0)


def test_timecode_that_is_set_back_by_a_few_frames_is_a_jump():
    rate = RATES["25"]
    path = course(readings(1000, 0.0, 100, rate) + readings(1095, 4.0, 100, rate), rate)
    assert [(time, before.frame, after.frame) for time, before, after in path.jumps()] == [(4.0, 1100, 1095)]


def test_before_the_first_and_after_the_last_reading():
    rate = RATES["24"]
    path = course(readings(240, 10.0, 48, rate), rate, "ltc")
    said = [str(one) for one in path.timecodes_at(np.array([0.01, 20.01]))]
    assert said == ["00:00:00:00", "00:00:20:00"]
    assert path.bridged_at(np.array([0.0, 10.5, 20.0])).tolist() == [True, False, True]


def test_no_reading_is_no_course():
    path = course([], RATES["25"], "ltc")
    assert path.runs == [] and path.drift_ppm is None and path.bridged_at(np.zeros(2)).all()
    with pytest.raises(ValueError, match="without a run"):
        path.frames_at(np.zeros(1))

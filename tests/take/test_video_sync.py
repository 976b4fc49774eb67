"""Videos of one performance are brought to one clock, by what is heard in them and by their timecodes."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.take.video.sync.find import FoundSync, find_sync
from studio.take.video.sync.timecode import apart_s, seconds_of
from tests.refused import refused
from tests.take.sync_videos import claps, heard, voices, write_film

NEAR_S = 0.003


def codes(found: FoundSync) -> set[str]:
    return {note.code for note in found.notes}


def film(folder: Path, name: str, scene: np.ndarray, start_s: float, length_s: float, **options) -> Path:
    sound = heard(scene, start_s, length_s, seed=len(name) + round(start_s * 7), **options)
    return write_film(folder / name, length_s, sound)


def check(found: FoundSync, starts_s: dict[str, float]) -> None:
    for name, start_s in starts_s.items():
        assert found.clocks[name].starts_s == pytest.approx(start_s, abs=NEAR_S), name
        assert found.clocks[name].within_s is not None


def test_voices_bring_videos_of_all_codecs_to_one_clock(tmp_path):
    scene = voices(40)
    starts_s = {"a": 0.0, "b": 7.2345, "c": 11.5}
    files = {
        "a": film(tmp_path, "a.mp4", scene, 0.0, 25.0),
        "b": film(tmp_path, "b.mov", scene, 7.2345, 20.0),
        "c": film(tmp_path, "c.mkv", scene, 11.5, 24.0),
    }
    for way in ("auto", "audio"):
        found = find_sync(files, way)
        assert found.way == "audio" and codes(found) == {"sync.used"}
        check(found, starts_s)


def test_a_short_noisy_video_is_found_in_a_long_one(tmp_path):
    scene = voices(40)
    files = {
        "long": film(tmp_path, "long.mp4", scene, 0.0, 40.0, noise=0.01),
        "short": film(tmp_path, "short.mp4", scene, 30.25, 4.0, noise=0.02),
    }
    check(find_sync(files), {"long": 0.0, "short": 30.25})


def test_the_drift_of_a_clock_is_found(tmp_path):
    scene = voices(140)
    files = {
        "a": film(tmp_path, "a.mov", scene, 0.0, 140.0),
        "b": film(tmp_path, "b.mov", scene, 5.0, 130.0, drift=60e-6),
    }
    found = find_sync(files, "audio")
    check(found, {"a": 0.0, "b": 5.0})
    assert found.clocks["b"].drift == pytest.approx(60e-6, abs=5e-6) and "sync.drift" in codes(found)
    times = found.clocks["b"].of(np.array([0, 100_000_000_000]))
    assert np.diff(times)[0] == pytest.approx(100_006_000_000, abs=500_000)


def test_what_is_not_heard_in_another_video_is_left_open(tmp_path):
    """No sound, silence, or the sound of another room: this is reported, and the others are synchronised."""
    scene = voices(30)
    files = {
        "a": film(tmp_path, "a.mp4", scene, 0.0, 20.0),
        "b": film(tmp_path, "b.mp4", scene, 3.5, 20.0),
        "mute": write_film(tmp_path / "mute.mp4", 2.0),
        "silent": write_film(tmp_path / "silent.mp4", 2.0, np.zeros(96_000)),
        "other": film(tmp_path, "other.mp4", voices(30, seed=9), 0.0, 20.0),
    }
    found = find_sync(files, "audio")
    check(found, {"a": 0.0, "b": 3.5})
    assert all(found.clocks[name].within_s is None for name in ("mute", "silent", "other"))
    assert codes(found) == {
        "sync.used", "sync.no_sound", "sync.silent", "sync.not_alike", "sync.left_open",
    }  # fmt: skip


def test_sounds_that_are_not_alike_are_refused(tmp_path):
    files = {
        name: film(tmp_path, f"{name}.mp4", voices(15, seed=k), 0.0, 12.0) for k, name in enumerate("ab")
    }
    with refused(FormatError, "sync.not_by"):
        find_sync(files, "audio")
    found = find_sync(files)
    assert found.way == "motion" and codes(found) == {"sync.motion_because"}
    assert all(clock.within_s is None for clock in found.clocks.values())


def test_one_clap_brings_videos_together(tmp_path):
    scene = claps(20, [6.0])
    files = {
        "a": film(tmp_path, "a.mp4", scene, 0.0, 12.0, noise=0.0005),
        "b": film(tmp_path, "b.mov", scene, 2.125, 12.0, noise=0.0005),
    }
    check(find_sync(files, "clap"), {"a": 0.0, "b": 2.125})


def test_of_several_claps_one_is_chosen(tmp_path):
    scene = claps(20, [6.0, 10.5])
    files = {
        "a": film(tmp_path, "a.mp4", scene, 0.0, 15.0, noise=0.0005),
        "b": film(tmp_path, "b.mov", scene, 3.0, 15.0, noise=0.0005),
    }
    with refused(FormatError, "sync.not_by") as error:
        find_sync(files, "clap")
    assert "a has 2 claps, at 6.00, 10.50 s" in str(error.value)
    found = find_sync(files, clap_at_s={"a": 10.0, "": 7.0})
    assert found.way == "clap"
    check(found, {"a": 0.0, "b": 3.0})
    with refused(FormatError, "sync.not_by"):
        find_sync(files, clap_at_s={"": 1.0})
    with refused(SettingsError, "sync.clap_of_none"):
        find_sync(files, clap_at_s={"c": 1.0})
    quiet = {name: film(tmp_path, f"{name}{name}.mp4", claps(9, []), 0.0, 8.0) for name in "ab"}
    with refused(FormatError, "sync.not_by"):
        find_sync(quiet, "clap")


def test_timecodes_bring_videos_of_other_rates_together_over_midnight(tmp_path):
    files = {
        "a": write_film(tmp_path / "a.mov", 20.0, timecode="23:59:50:05"),
        "b": write_film(tmp_path / "b.mov", 20.0, timecode="00:00:02:45", frames_per_second=Fraction(50)),
    }
    found = find_sync(files, "timecode")
    check(found, {"a": 0.0, "b": 12.7})
    assert find_sync(files).way == "timecode"


def test_a_video_that_shares_no_time_with_the_others_is_said(tmp_path):
    starts = {"a": "10:00:00:00", "b": "10:00:03:00", "late": "11:00:00:00"}
    files = {name: write_film(tmp_path / f"{name}.mov", 8.0, timecode=at) for name, at in starts.items()}
    found = find_sync(files, "timecode")
    check(found, {"a": 0.0, "b": 3.0})
    assert "sync.no_common_time" in codes(found) and found.clocks["late"].within_s is None


def test_timecodes_that_say_nothing_are_refused(tmp_path):
    for at in ("00:00:00:00", ""):
        files = {name: write_film(tmp_path / f"{name}.mov", 3.0, timecode=at) for name in "ab"}
        with refused(FormatError, "sync.not_by"):
            find_sync(files, "timecode")


def test_times_of_recording_are_a_rough_hint(tmp_path):
    files = {
        name: write_film(tmp_path / f"{name}.mkv", 8.0, created=f"2024-05-06T07:08:{at}Z")
        for name, at in (("a", "01.500000"), ("b", "04.250000"))
    }
    found = find_sync(files)
    check(found, {"a": 0.0, "b": 2.75})
    assert found.clocks["b"].within_s == 3.0 and "sync.rough" in codes(found)


def test_a_cut_off_video_is_brought_to_the_clock_too(tmp_path):
    scene = voices(30)
    files = {
        "a": film(tmp_path, "a.mp4", scene, 0.0, 25.0),
        "cut": film(tmp_path, "cut.mkv", scene, 4.0, 25.0),
    }
    whole = files["cut"].read_bytes()
    files["cut"].write_bytes(whole[: len(whole) * 2 // 3])
    check(find_sync(files), {"a": 0.0, "cut": 4.0})


def test_ways_that_leave_the_times_as_they_are(tmp_path):
    files = {name: write_film(tmp_path / f"{name}.mov", 3.0) for name in "ab"}
    together, left = find_sync(files, "none"), find_sync(files, "motion")
    assert codes(together) == {"sync.together"} and codes(left) == {"sync.motion"}
    assert all(clock.within_s is not None for clock in together.clocks.values())
    assert all(clock.within_s is None for clock in left.clocks.values())
    with refused(SettingsError, "value.bad"):
        find_sync(files, "magic")
    assert find_sync({"a": files["a"]}).way == "none"


@pytest.mark.parametrize(
    ("timecode", "rate", "seconds"),
    [
        ("01:00:00:00", 25.0, 3600.0),
        ("00:00:01:12", 25.0, 1.48),
        ("01:00:00:00", 30000 / 1001, 3603.6),
        ("01:00:00;00", 30000 / 1001, 3600.0 - 0.0036),
        ("00:01:00;02", 29.97, 1800 * 1.001 / 30),
        ("00:10:00;00", 59.94, 600.0 - 0.0006),
        ("01:00:00:00", 23.976, 3603.6),
        ("00:00:00:30", 30.0, None),
        ("24:00:00:00", 25.0, None),
        ("00:00:00:00", 27.4, None),
        ("noon", 25.0, None),
    ],
)
def test_timecodes_as_times_of_the_day(timecode, rate, seconds):
    found = seconds_of(timecode, rate)
    assert found == (None if seconds is None else pytest.approx(seconds, abs=1e-4))


def test_the_day_ends_at_midnight():
    assert apart_s(86399.0, 1.0) == pytest.approx(2.0) and apart_s(1.0, 86399.0) == pytest.approx(-2.0)

"""Videos brought to one clock by the timecodes of their files, else roughly by their times of recording."""

from collections.abc import Mapping
from datetime import datetime

from studio.engine.base.sentences import say
from studio.take.video.file import VideoFile
from studio.take.video.sync.clocks import ByClock, VideoClock
from studio.take.video.sync.timecode import apart_s, seconds_of

_WITHIN_S, _WITHIN_FRAMES = 0.1, 2.0
_ROUGH_S = 3.0
_LEAST_SHARED_S = 1.0


def by_timecode(videos: Mapping[str, VideoFile]) -> ByClock:
    """Return the clocks of videos by timecode.

    If fewer than two have one, times of recording with fractions of a second are a rough hint.
    """
    out = ByClock()
    times = {}
    for name, video in videos.items():
        if not video.timecode:
            out.problems.append(say("sync.no_timecode", "{name} has no timecode", name=name))
            continue
        seconds = seconds_of(video.timecode, video.frames_per_second)
        if seconds is None:
            out.problems.append(
                say(
                    "sync.bad_timecode",
                    "{name} begins at {timecode}, which is no timecode at {rate:.4g} Hz",
                    name=name,
                    timecode=video.timecode,
                    rate=video.frames_per_second,
                )
            )
            continue
        times[name] = seconds
    if len(times) < 2:
        return _by_recording_time(videos, out)
    if not any(times.values()):
        out.problems.append(
            say("sync.timecodes_zero", "all timecodes begin at 0: the cameras were not set to one clock")
        )
        return out
    first = next(iter(times.values()))
    slowest = min(videos[name].frames_per_second for name in times)
    within_s = max(_WITHIN_S, _WITHIN_FRAMES / slowest)
    clocks = {name: VideoClock(apart_s(first, one), within_s=within_s) for name, one in times.items()}
    out.clocks = _overlapping(videos, clocks, out, 0.0)
    return out


def _by_recording_time(videos: Mapping[str, VideoFile], out: ByClock) -> ByClock:
    times = {
        name: datetime.fromisoformat(video.created).timestamp()
        for name, video in videos.items()
        if "." in video.created
    }
    if len(times) < 2:
        return out
    first = next(iter(times.values()))
    clocks = {name: VideoClock(one - first, within_s=_ROUGH_S) for name, one in times.items()}
    out.clocks = _overlapping(videos, clocks, out, _ROUGH_S)
    if len(out.clocks) > 1:
        out.notes.append(
            say(
                "sync.rough",
                "only times of recording are known, to about {within:g} s: calibrate to find the rest by the motion",
                within=_ROUGH_S,
            )
        )
    return out


def _overlapping(
    videos: Mapping[str, VideoFile], clocks: dict[str, VideoClock], out: ByClock, margin_s: float
) -> dict[str, VideoClock]:
    """Return the clocks of the videos that overlap with another one; report the others."""
    spans = {}
    for name, clock in clocks.items():
        length_s = videos[name].duration_s or float("inf")  # a file without a length may be long
        spans[name] = clock.starts_s - margin_s, clock.starts_s + length_s + margin_s
    kept = {}
    for name, (begin, end) in spans.items():
        least = min(_LEAST_SHARED_S, 0.5 * (end - begin))
        if any(
            min(end, other[1]) - max(begin, other[0]) >= least for one, other in spans.items() if one != name
        ):
            kept[name] = clocks[name]
        else:
            out.problems.append(
                say(
                    "sync.no_common_time",
                    "{name} shares no time with the others by its timecode: leave it out, or choose another way",
                    name=name,
                )
            )
    return kept

"""Brings the videos of one performance to one clock, and reports how."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.base.sentences import Said, say
from studio.engine.base.value_sentences import bad_value
from studio.take.video.file import VideoFile
from studio.take.video.sync.by_sound import by_claps, by_sound
from studio.take.video.sync.by_timecode import by_timecode
from studio.take.video.sync.clocks import ByClock, VideoClock
from studio.take.video.sync.sound import Sound, read_sound

WAYS = ("auto", "audio", "clap", "timecode", "motion", "none")
"""Ways to bring videos to one clock: `auto` uses the first of `audio`, `clap` and `timecode` that places most of
them, else `motion`, which leaves it to calibration; `none` assumes that they begin together."""

_NONE_WITHIN_S = 0.1
_SHOWN = 6


@dataclass(frozen=True)
class FoundSync:
    """How videos were brought to one clock.

    Attributes:
        way: that was used, one of `WAYS` without `auto`.
        clocks: by camera.
        notes: the result, and why other ways failed.
    """

    way: str
    clocks: dict[str, VideoClock]
    notes: list[Said] = field(default_factory=list)


def check_way(way: str) -> None:
    """Raise if there is no such way.

    Raises:
        SettingsError: not one of `WAYS`.
    """
    if way not in WAYS:
        raise SettingsError(bad_value("sync", way, WAYS))


def find_sync(
    files: Mapping[str, Path],
    way: str = "auto",
    *,
    clap_at_s: Mapping[str, float] | None = None,
    progress: Callable[[float], None] | None = None,
) -> FoundSync:
    """Return the clocks of videos of one performance.

    A video that the way cannot place stays open, and the notes report it: calibration places it by the motion.

    Args:
        files: by camera.
        way: one of `WAYS`.
        clap_at_s: about when the clap is heard in a camera's video [s]; the name "" is for all others.
        progress: receives the share done.

    Raises:
        SettingsError: no such way, or a clap of a camera that is not there.
        FormatError: the way, if it is not `auto`, places no two videos; or a file that is no video.
    """
    check_way(way)
    clap_at_s = clap_at_s or {}
    unknown = [name for name in clap_at_s if name and name not in files]
    if unknown:
        raise SettingsError(
            "sync.clap_of_none",
            "--clap-at {name}: there is no such video; allowed: {names}",
            name=unknown[0],
            names=[*files],
        )
    if way == "auto" and clap_at_s:
        way = "clap"
    if len(files) < 2 or way in ("none", "motion"):
        return _untouched(files, way if way != "auto" else "none")
    videos = {name: VideoFile.open(file) for name, file in files.items()}
    sounds: dict[str, Sound | None] = {}
    if way != "timecode":
        for k, (name, file) in enumerate(files.items()):
            sounds[name] = read_sound(file)
            if progress is not None:
                progress(0.8 * (k + 1) / len(files))
    ways: dict[str, Callable[[], ByClock]] = {
        "audio": lambda: by_sound(sounds),
        "clap": lambda: by_claps(sounds, clap_at_s),
        "timecode": lambda: by_timecode(videos),
    }
    tried: dict[str, ByClock] = {}
    for name in ways if way == "auto" else (way,):
        tried[name] = ways[name]()
        if len(tried[name].clocks) == len(files):
            break
    best = max(tried, key=lambda name: len(tried[name].clocks))  # the first of equal ones
    if progress is not None:
        progress(1.0)
    return _chosen(files, way, best, tried)


def _chosen(files: Mapping[str, Path], way: str, best: str, tried: Mapping[str, ByClock]) -> FoundSync:
    found = tried[best]
    reasons = [*dict.fromkeys(reason for one in tried.values() for reason in one.problems)]  # each once
    if len(found.clocks) < 2:
        if way == "auto":
            return replace(_untouched(files, "motion"), notes=[_motion(reasons[:_SHOWN])])
        raise FormatError(
            "sync.not_by",
            "the videos cannot be brought to one clock by {way}: {reasons}; choose another way: {ways}",
            way=way,
            reasons=reasons,
            ways=[one for one in WAYS if one != way],
        )
    begin = min(clock.starts_s for clock in found.clocks.values())
    clocks = {name: replace(clock, starts_s=clock.starts_s - begin) for name, clock in found.clocks.items()}
    shown = [f"{name} {clock.starts_s:.3f} s" for name, clock in clocks.items()]
    notes = [
        say("sync.used", "brought to one clock by {way}: {starts}", way=best, starts=shown),
        *found.notes,
    ]
    others = [reason for name, one in tried.items() if name != best for reason in one.problems]
    if way == "auto" and others and next(iter(tried)) != best:
        notes.append(say("sync.not_first", "other ways did not do: {reasons}", reasons=others[:_SHOWN]))
    open_ones = [name for name in files if name not in clocks]
    notes += found.problems
    if open_ones:
        notes.append(
            say(
                "sync.left_open",
                "when {names} began is found by the motion when the cameras are calibrated",
                names=open_ones,
            )
        )
    return FoundSync(best, {name: clocks.get(name, VideoClock()) for name in files}, notes)


def _untouched(files: Mapping[str, Path], way: str) -> FoundSync:
    """Return videos that begin together, for certain or until a calibration finds their offsets."""
    if len(files) < 2:
        return FoundSync("none", {name: VideoClock() for name in files})
    if way == "motion":
        return FoundSync(way, {name: VideoClock() for name in files}, [_motion([])])
    clocks = {name: VideoClock(within_s=_NONE_WITHIN_S) for name in files}
    return FoundSync(way, clocks, [say("sync.together", "the videos were taken to begin together")])


def _motion(reasons: list[Said]) -> Said:
    if not reasons:
        return say(
            "sync.motion", "the videos begin together here; calibrate to find how far apart they began"
        )
    return say(
        "sync.motion_because",
        "the videos begin together here; calibrate to find by the motion how far apart they began, because nothing "
        "else says it: {reasons}",
        reasons=reasons,
    )

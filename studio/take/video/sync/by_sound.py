"""Videos brought to one clock by their sound: by all of it, or by one clap."""

from collections.abc import Mapping
from functools import partial

from studio.engine.base.sentences import say
from studio.take.video.sync.clap import find_claps
from studio.take.video.sync.clocks import ByClock, VideoClock
from studio.take.video.sync.sound import Sound
from studio.take.video.sync.sound_delay import find_delay

WITHIN_S = 0.1
"""Maximum offset of sound and picture of one file: phones and webcams some 50 ms, 7 m of air 20 ms."""

_NEAR_S = 2.0
_MOST_SHOWN = 5
_TOLD_DRIFT = 2e-6


def by_sound(sounds: Mapping[str, Sound | None]) -> ByClock:
    """Return the clocks of videos by cross-correlation of their sounds: each by the first placed one that it clearly
    resembles."""
    out = ByClock()
    heard = _heard(sounds, out)
    if len(heard) < 2:
        return out
    waiting = sorted(heard, key=lambda name: -len(heard[name].samples))
    placed = {}
    for root in list(waiting):  # the first one that another resembles
        placed = _grown(root, heard)
        if len(placed) > 1:
            break
    if len(placed) > 1:
        out.clocks = {name: placed[name] for name in heard if name in placed}
    for name in heard:
        if name not in out.clocks:
            out.problems.append(
                say(
                    "sync.not_alike",
                    "the sound of {name} is not clearly like that of another video",
                    name=name,
                )
            )
        elif abs(out.clocks[name].drift) > _TOLD_DRIFT:
            out.notes.append(
                say(
                    "sync.drift",
                    "the clock of {name} is {ppm:.0f} ppm slow against the longest video; its times were corrected",
                    name=name,
                    ppm=out.clocks[name].drift * 1e6,
                )
            )
    return out


def _grown(root: str, heard: Mapping[str, Sound]) -> dict[str, VideoClock]:
    """Return the clocks of all sounds that resemble `root`, directly or through others."""
    placed = {root: VideoClock(within_s=WITHIN_S)}
    compared: set[tuple[str, str]] = set()
    while True:
        pairs = [(a, b) for b in heard if b not in placed for a in placed if (a, b) not in compared]
        if not pairs:
            return placed
        a, b = pairs[0]
        compared.add((a, b))
        delay = find_delay(heard[a], heard[b])
        if delay is not None:
            own = placed[a]
            drift = (1.0 + own.drift) * (1.0 + delay.drift) - 1.0
            starts_s = own.starts_s + (1.0 + own.drift) * delay.ahead_s
            placed[b] = VideoClock(starts_s, drift, WITHIN_S)


def by_claps(sounds: Mapping[str, Sound | None], clap_at_s: Mapping[str, float]) -> ByClock:
    """Return the clocks of videos by the one clap in each.

    Args:
        sounds: by camera.
        clap_at_s: see `find_sync`.
    """
    out = ByClock()
    for name, sound in _heard(sounds, out).items():
        claps = find_claps(sound)
        about = clap_at_s.get(name, clap_at_s.get(""))
        if about is not None:
            claps = sorted(claps, key=partial(_apart, about))[:1]
            claps = [one for one in claps if _apart(about, one) < _NEAR_S]
        if len(claps) == 1:
            out.clocks[name] = VideoClock(-claps[0], within_s=WITHIN_S)
        elif claps:
            out.problems.append(
                say(
                    "sync.several_claps",
                    "{name} has {n} claps, at {times} s: say which one counts (--clap-at {name}=SECOND)",
                    name=name,
                    n=len(claps),
                    times=[f"{one:.2f}" for one in claps[:_MOST_SHOWN]],
                )
            )
        elif about is not None:
            out.problems.append(
                say(
                    "sync.no_clap_there",
                    "no clap is heard in {name} within {near:g} s of second {about:g}",
                    name=name,
                    near=_NEAR_S,
                    about=about,
                )
            )
        else:
            out.problems.append(say("sync.no_clap", "no clap is heard in {name}", name=name))
    return out


def _apart(a: float, b: float) -> float:
    return abs(a - b)


def _heard(sounds: Mapping[str, Sound | None], out: ByClock) -> dict[str, Sound]:
    """Return the sounds that are not silent; report the videos without one."""
    heard = {}
    for name, sound in sounds.items():
        if sound is None:
            out.problems.append(say("sync.no_sound", "{name} has no sound", name=name))
        elif sound.silent:
            out.problems.append(say("sync.silent", "the sound of {name} is silent", name=name))
        else:
            heard[name] = sound
    return heard

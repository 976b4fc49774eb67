"""OpenTimelineIO: the takes as clips on a timeline at their timecode, which refer to motion files next to it.

Plain JSON in the schemas Timeline.1, Stack.1, Track.1, Clip.2, Gap.1, ExternalReference.1 and Marker.2, as
OpenTimelineIO 0.15 and later read it. Source: opentimelineio.readthedocs.io, "File Format Specification".
"""

import json
import os
from collections.abc import Callable, Sequence
from typing import Any

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.base.errors import SettingsError
from studio.engine.base.files import write_atomically
from studio.engine.model.poses import Poses
from studio.engine.timecode.timecode import RATES, Timecode

_WITHOUT = RATES["60"]
"""Rate of a timeline of takes without timecode; it begins at 0."""


def write_otio(
    takes: Sequence[tuple[Poses, ExportOptions]],
    path: str | os.PathLike[str],
    options: ExportOptions,
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write takes as one timeline, atomically, in order of their timecode.

    Args:
        takes: poses and options of each.
        path: of the file.
        options: of the first take.
        progress: receives the share done.

    Raises:
        SettingsError: the takes have timecode of several rates, or overlap.
        StudioError: the file cannot be written.
    """
    placed = sorted((_place(poses, own) for poses, own in takes), key=lambda one: one["first"].frame)
    rates = {one["first"].rate for one in placed}
    if len(rates) > 1:
        raise SettingsError(
            "export.otio_rates",
            "the takes have timecode at {rates}; a timeline has one rate: export each to a file of its own",
            rates=sorted(rate.name for rate in rates),
        )
    rate = rates.pop()
    children: list[dict[str, Any]] = []
    at = placed[0]["first"].frame
    for one in placed:
        if one["first"].frame < at:
            raise SettingsError(
                "export.otio_overlap",
                "take {take} begins at {timecode}, within the one before; export each to a file of its own",
                take=one["name"],
                timecode=str(one["first"]),
            )
        if one["first"].frame > at:
            children.append(_item("Gap.1", "", 0, one["first"].frame - at, rate.fps))
        children.append(_clip(one, rate.fps))
        at = one["first"].frame + one["count"]
    track = {**_item("Track.1", "motion", None, 0, rate.fps), "kind": "Video", "children": children}
    stack = {**_item("Stack.1", "tracks", None, 0, rate.fps), "children": [track]}
    timeline = {
        "OTIO_SCHEMA": "Timeline.1",
        "metadata": {"capture_studio": {"timecode_rate": rate.name}},
        "name": placed[0]["name"],
        "global_start_time": _time(placed[0]["first"].frame, rate.fps),
        "tracks": stack,
    }
    with write_atomically(path) as file:
        file.write(json.dumps(timeline, indent=2).encode())


def _place(poses: Poses, options: ExportOptions) -> dict[str, Any]:
    """Return a take's name, first timecode, number of frames, and its timecode's drift and bridged spans."""
    course, times = options.timecodes, poses.time_s
    rate = _WITHOUT if course is None else course.rate
    seconds = float(times[-1] - times[0]) + 1.0 / poses.frames_per_second
    first = Timecode(0, rate) if course is None else course.timecodes_at(times[:1])[0]
    bridged = [] if course is None else _spans(times, course.bridged_at(times))
    return {
        "name": options.take_name,
        "first": first,
        "count": max(1, round(seconds * rate.fps)),
        "drift_ppm": None if course is None else course.drift_ppm,
        "bridged": [(begin - times[0], end - times[0]) for begin, end in bridged],
    }


def _spans(times: Any, inside: Any) -> list[tuple[float, float]]:
    """Return the spans of time in which `inside` is true [s]."""
    found: list[tuple[float, float]] = []
    for time_s, holds, before in zip(times.tolist(), inside, [False, *inside[:-1]], strict=True):
        if holds and not before:
            found.append((time_s, time_s))
        elif holds:
            found[-1] = found[-1][0], time_s
    return found


def _clip(one: dict[str, Any], fps: float) -> dict[str, Any]:
    first, count = one["first"].frame, one["count"]
    media = {
        "OTIO_SCHEMA": "ExternalReference.1",
        "metadata": {},
        "name": one["name"],
        "available_range": _range(first, count, fps),
        "available_image_bounds": None,
        "target_url": f"{one['name']}.fbx",
    }
    markers = [
        {
            "OTIO_SCHEMA": "Marker.2",
            "metadata": {},
            "name": "timecode bridged",
            "color": "RED",
            "comment": "no timecode came here; the clock went on",
            "marked_range": _range(first + round(begin * fps), max(1, round((end - begin) * fps)), fps),
        }
        for begin, end in one["bridged"]
    ]
    return {
        **_item("Clip.2", one["name"], first, count, fps),
        "metadata": {"capture_studio": {"drift_ppm": one["drift_ppm"]}},
        "markers": markers,
        "media_references": {"DEFAULT_MEDIA": media},
        "active_media_reference_key": "DEFAULT_MEDIA",
    }


def _item(schema: str, name: str, first: int | None, count: int, fps: float) -> dict[str, Any]:
    """Return the fields that every item of a timeline has; `first` None: as long as its content."""
    return {
        "OTIO_SCHEMA": schema,
        "metadata": {},
        "name": name,
        "source_range": None if first is None else _range(first, count, fps),
        "effects": [],
        "markers": [],
        "enabled": True,
    }


def _range(first: int, count: int, fps: float) -> dict[str, Any]:
    return {
        "OTIO_SCHEMA": "TimeRange.1",
        "start_time": _time(first, fps),
        "duration": _time(count, fps),
    }


def _time(frame: int, fps: float) -> dict[str, Any]:
    return {"OTIO_SCHEMA": "RationalTime.1", "rate": fps, "value": float(frame)}

"""Options of an export: `ExportOptions`, their check, and the options that each format understands."""

import math
from dataclasses import dataclass, fields
from typing import Any

from studio.engine.animation.clip.timecode import timecode_seconds
from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import say
from studio.engine.timecode.course import TimecodeCourse

INTERPOLATIONS = ("cubic", "linear", "constant")
TARGETS = ("humanik", "mixamo", "unreal", "vrm")
ROOT_MOTIONS = ("hips", "root", "in-place")
ROTATION_ORDERS = ("ZXY", "ZYX", "YZX", "XZY", "YXZ", "XYZ")
UNITS_M: dict[str, float] = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254}
"""Name of a unit -> metres."""

MAX_FPS = 1000.0

_CHOICES: dict[str, tuple[str, ...]] = {
    "interpolation": INTERPOLATIONS,
    "target": TARGETS,
    "root_motion": ROOT_MOTIONS,
    "rotation_order": ROTATION_ORDERS,
    "unit": tuple(UNITS_M),
}


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export, checked by `check_options`.

    Attributes:
        fps: rate of the keys [Hz]; None keeps that of the poses.
        interpolation: between keys: `cubic`, `linear` or `constant`.
        target: names, bones and axes of the skeleton: one of `TARGETS`.
        root_motion: carrier of the performer's path: the `hips`, a `root` bone on the floor, or none
            (`in-place`).
        mesh: with a skinned body; None = the format's default.
        start_s, end_s: exported part of the take [s from its first frame]; None = all of it.
        rotation_order: of a BVH's channels.
        unit: of a BVH: a key of `UNITS_M`.
        key_error_cm: keys are removed while no joint moves by more than this [cm]; None keeps a key per frame.
        take_name: name of the animation in the file.
        timecode: time of day of the take's first frame, hh:mm:ss:ff at the export's rate; keys then start
            there. None starts at 0.
        timecodes: timecode of every stage time, in place of `timecode`; written if the format has a place for it.
        smooth_hz: cutoff of a zero-phase low-pass filter [Hz]; None = off.
        loop: trim the clip to its best loop, and blend its end into its start.
        foot_lock: hold standing feet in place, by bending the legs.
        undecided_s: for one of several performers, spans of stage time [s] with uncertain identity; None = a single
            performer.
    """

    fps: float | None = None
    interpolation: str = "cubic"
    target: str = "humanik"
    root_motion: str = "hips"
    mesh: bool | None = None
    start_s: float | None = None
    end_s: float | None = None
    rotation_order: str = "ZXY"
    unit: str = "cm"
    key_error_cm: float | None = None
    take_name: str = "Take"
    timecode: str | None = None
    timecodes: TimecodeCourse | None = None
    smooth_hz: float | None = None
    loop: bool = False
    foot_lock: bool = False
    undecided_s: tuple[tuple[float, float], ...] | None = None


POSE_OPTIONS = frozenset(
    {"fps", "start_s", "end_s", "take_name", "smooth_hz", "loop", "foot_lock", "undecided_s"}
)
"""Options that every format understands, because they concern the poses."""

_BEFORE_CHECKED: dict[str, str] = {
    "interpolation": "each program chooses its own between keys",
    "mesh": say("export.format_no_body", "the format holds no body"),
    "key_error_cm": say("export.format_every_frame", "the format has a value for every frame"),
    "timecode": say("export.format_no_time", "the format has no time of day"),
    "timecodes": say("export.format_no_time", "the format has no time of day"),
    "target": say("export.format_points", "the format holds points, not bones"),
    "root_motion": say("export.format_points", "the format holds points, not bones"),
}


def check_options(options: ExportOptions, format: str, understood: frozenset[str]) -> None:
    """Refuse values that are not allowed, and options that the format does not understand.

    Args:
        options: of the export.
        format: for the message.
        understood: names of the options that the format understands besides `POSE_OPTIONS`.

    Raises:
        SettingsError: with the option, the value and the allowed values.
    """
    for name, allowed in _CHOICES.items():
        value = getattr(options, name)
        if value not in allowed:
            raise SettingsError(
                "export.value",
                "{name}={value}: allowed are {allowed}",
                name=_shown(name),
                value=value,
                allowed=[*allowed],
            )
    defaults = ExportOptions()
    for field in fields(options):
        name, value = field.name, getattr(options, field.name)
        if value != getattr(defaults, name) and name not in understood | POSE_OPTIONS:
            why = _BEFORE_CHECKED.get(name, "the format has nothing of the kind")
            raise SettingsError(
                "export.not_for_format",
                "{name}={value}: not for {format} ({why}); leave it out",
                name=_shown(name).replace("timecodes", "timecode"),
                value=value.rate.name if isinstance(value, TimecodeCourse) else value,
                format=format,
                why=why,
            )
    _check_numbers(options)
    if not options.take_name or not options.take_name.isprintable():
        raise SettingsError(
            "export.take_name",
            "take-name={name!r}: allowed is a name of printable characters",
            name=options.take_name,
        )
    if options.timecode is not None:
        timecode_seconds(options.timecode, options.fps or 60.0)
    _check_together(options)


def _check_numbers(options: ExportOptions) -> None:
    ranges: dict[str, tuple[Any, float, float]] = {
        "fps": (options.fps, 0.0, MAX_FPS),
        "key-error-cm": (options.key_error_cm, 0.0, 100.0),
        "smooth-hz": (options.smooth_hz, 0.0, MAX_FPS),
    }
    for name, (value, low, high) in ranges.items():
        if value is not None and not low < value <= high:  # NaN fails too
            raise SettingsError(
                "export.between",
                "{name}={value}: allowed is a number above {low:g} and up to {high:g}",
                name=name,
                value=value,
                low=low,
                high=high,
            )
    for name, value in (("start", options.start_s), ("end", options.end_s)):
        if value is not None and not (math.isfinite(value) and value >= 0.0):
            raise SettingsError(
                "export.seconds",
                "{name}={value}: allowed is a number of seconds from 0",
                name=name,
                value=value,
            )


def _check_together(options: ExportOptions) -> None:
    start = 0.0 if options.start_s is None else options.start_s
    if options.end_s is not None and options.end_s <= start:
        raise SettingsError(
            "export.end",
            "end={end:g}: allowed is a number above start={start:g}",
            end=options.end_s,
            start=start,
        )
    if options.key_error_cm is not None and options.interpolation == "constant":
        raise SettingsError(
            "export.key_error_constant",
            "key-error-cm goes with interpolation cubic or linear, not constant; leave one out",
        )


def _shown(name: str) -> str:
    """Return an option's name on the command line."""
    return name.removesuffix("_s").replace("_", "-")

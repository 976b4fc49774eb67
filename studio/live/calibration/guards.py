"""Warnings about the calibration before a recording: does it still fit this stage?"""

from collections.abc import Iterable
from datetime import UTC, datetime

from studio.engine.base.sentences import about, say
from studio.live.calibration.kept import KeptCalibration
from studio.live.cameras.camera import LiveCamera

OLD_S = 12 * 3600.0
"""Age from which a calibration is old; by then a tripod may have been touched."""


def age_s(kept: KeptCalibration | None, now: datetime | None = None) -> float | None:
    """Return the age of a calibration [s], None where unknown."""
    if kept is None or not kept.created:
        return None
    try:
        created = datetime.fromisoformat(kept.created)
    except ValueError:
        return None
    return max(((now or datetime.now(UTC)) - created).total_seconds(), 0.0)


def calibration_warnings(
    kept: KeptCalibration | None,
    cameras: Iterable[LiveCamera],
    moved_m: dict[str, float],
    now: datetime | None = None,
) -> list[str]:
    """Return warnings about the calibration in use, with advice.

    Args:
        kept: the calibration in use, None where there is none.
        cameras: all that were connected since the start.
        moved_m: cameras that were moved, with their joints' distance from the others' [m].
        now: the present time.
    """
    if kept is None:
        return []
    known = kept.calibration.cameras
    connected = {camera.name: camera for camera in cameras if camera.connected}
    warnings: list[str] = [
        say(
            "calibration.camera_added",
            "{name} was added after the calibration and is not used: calibrate again",
            name=name,
        )
        for name in sorted(set(connected) - set(known))
    ]
    warnings += [
        say(
            "calibration.camera_missing",
            "{name} is in the calibration and not connected: connect it, or go on without it",
            name=name,
        )
        for name in sorted(set(known) - set(connected))
        if connected  # without any camera, the page shows one message
    ]
    unknown = say("calibration.unknown", "unknown")
    for name, was in sorted((kept.devices or {}).items()):
        serial = connected[name].hello.serial if name in connected else was
        if serial != was:
            warnings.append(
                say(
                    "calibration.camera_exchanged",
                    "{name} is another device now (serial {serial}, calibrated with {was}): give the cameras "
                    "their old names, or calibrate again",
                    name=name,
                    serial=serial or unknown,
                    was=was or unknown,
                )
            )
    warnings += [
        about(name, moved_words(metres)) for name, metres in sorted(moved_m.items()) if name in connected
    ]
    age = age_s(kept, now)
    if age is not None and age > OLD_S:
        warnings.append(
            say(
                "calibration.old",
                "the calibration is {age} old: walk through the stage and look whether the cameras "
                "agree, or calibrate again",
                age=age_words(age),
            )
        )
    return warnings


def shared_usb(cameras: Iterable[LiveCamera], now_ns: int) -> dict[str, str]:
    """Return, by camera, a warning that it may lack frames because of a shared USB controller, with advice.

    It concerns cameras of one machine that are slow at the same time, unless their controllers are known to be
    different. The routes of their frames to the server cannot be distinguished, but each has a nominal rate.

    Args:
        cameras: the connected cameras.
        now_ns: the present on the server's clock.
    """
    slow = [camera for camera in cameras if camera.hello.machine and camera.slow(now_ns)]
    out = {}
    for camera in slow:
        mine = camera.hello.usb_controller
        others = [
            other
            for other in slow
            if other is not camera
            and other.hello.machine == camera.hello.machine
            and (not mine or not other.hello.usb_controller or other.hello.usb_controller == mine)
        ]
        if not others:
            continue
        names = " and ".join(other.name for other in others)
        known = all(mine and other.hello.usb_controller == mine for other in others)
        shared = say("camera.usb_shared", "shares USB controller {mine} with {names}", mine=mine, names=names)
        near = say("camera.usb_same_machine", "as is {names} on the same machine", names=names)
        out[camera.name] = say(
            "camera.usb",
            "{place}; plug them into ports of different USB controllers or machines, or lower their frame rates",
            place=shared if known else near,
        )
    return out


def moved_words(metres: float) -> str:
    """Return the warning that a camera was moved."""
    return say(
        "camera.moved",
        "its joints are {cm:.0f} cm off the other cameras': was it moved? Put it back, or calibrate again",
        cm=metres * 100,
    )


def age_words(age_s: float) -> str:
    """Return an age in words."""
    hours = age_s / 3600.0
    if hours < 1.5:
        return f"{max(round(age_s / 60), 1)} min"
    return f"{hours:.0f} h" if hours < 48 else say("calibration.days", "{n:.0f} days", n=hours / 24)

"""Warnings about the calibration before a recording: does it still fit this stage?"""

from collections.abc import Iterable
from datetime import UTC, datetime

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
    warnings = [
        f"{name} was added after the calibration and is not used: calibrate again"
        for name in sorted(set(connected) - set(known))
    ]
    warnings += [
        f"{name} is in the calibration and not connected: connect it, or go on without it"
        for name in sorted(set(known) - set(connected))
        if connected  # without any camera, the page shows one message
    ]
    for name, was in sorted((kept.devices or {}).items()):
        serial = connected[name].hello.serial if name in connected else was
        if serial != was:
            warnings.append(
                f"{name} is another device now (serial {serial or 'unknown'}, calibrated with {was or 'unknown'}): "
                "give the cameras their old names, or calibrate again"
            )
    warnings += [
        f"{name}: {moved_words(metres)}" for name, metres in sorted(moved_m.items()) if name in connected
    ]
    age = age_s(kept, now)
    if age is not None and age > OLD_S:
        warnings.append(
            f"the calibration is {age_words(age)} old: walk through the stage and look whether the cameras agree, or "
            "calibrate again"
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
        place = (
            f"shares USB controller {mine} with {names}" if known else f"as is {names} on the same machine"
        )
        out[camera.name] = (
            f"{place}; plug them into ports of different USB controllers or machines, or lower their frame rates"
        )
    return out


def moved_words(metres: float) -> str:
    """Return the warning that a camera was moved."""
    return (
        f"its joints are {metres * 100:.0f} cm off the other cameras': was it moved? "
        "Put it back, or calibrate again"
    )


def age_words(age_s: float) -> str:
    """Return an age in words."""
    hours = age_s / 3600.0
    if hours < 1.5:
        return f"{max(round(age_s / 60), 1)} min"
    return f"{hours:.0f} h" if hours < 48 else f"{hours / 24:.0f} days"

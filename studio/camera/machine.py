"""What a client knows of the machine that it runs on: which one it is, and which USB controller a device hangs at."""

import hashlib
import platform
import uuid
from pathlib import Path

from studio.engine.system import USB_DEVICES


def machine_id() -> str:
    """Return a text that is alike for all clients on this machine, and tells nothing else of it."""
    return hashlib.sha256(f"{platform.node()} {uuid.getnode():x}".encode()).hexdigest()[:16]


def usb_controller(serial: str, devices: Path = USB_DEVICES) -> str:
    """Return the name of the USB controller that a device hangs at, such as `0000:00:14.0`; "" = not known.

    Linux tells it: a device's folder lies in that of its root hub, `usb<number>`, and this one in its controller's.

    Args:
        serial: the device's serial number, as its USB descriptor has it.
        devices: the folder in which the system lists USB devices.
    """
    if not serial or not devices.is_dir():
        return ""
    for entry in sorted(devices.glob("*/serial")):
        try:
            if entry.read_text(encoding="utf-8", errors="replace").strip() != serial:
                continue
            place = entry.resolve().parent
        except OSError:  # unplugged meanwhile
            continue
        for above in place.parents:
            if above.name.startswith("usb") and above.name[3:].isdigit():
                return above.parent.name
    return ""

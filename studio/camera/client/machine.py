"""Facts of the client's machine: its identifier, and the USB controller of a device."""

import hashlib
import platform
import uuid
from pathlib import Path

from studio.engine.base.system import USB_DEVICES


def machine_id() -> str:
    """Return an identifier that is the same for all clients on this machine, and says nothing else about it."""
    return hashlib.sha256(f"{platform.node()} {uuid.getnode():x}".encode()).hexdigest()[:16]


def usb_controller(serial: str, devices: Path = USB_DEVICES) -> str:
    """Return the name of a device's USB controller, such as `0000:00:14.0`; "" = unknown.

    On Linux, a device's folder lies in that of its root hub, `usb<number>`, which lies in its controller's.

    Args:
        serial: the device's serial number, from its USB descriptor.
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

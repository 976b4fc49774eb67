"""Plugged-in devices that Linux reports without their libraries: USB devices and video devices."""

from dataclasses import dataclass
from pathlib import Path

from studio.camera.sources.config import FoundDevice
from studio.engine.base.errors import NotAvailableError
from studio.engine.base.system import USB_DEVICES, VIDEO_DEVICES

_ORBBEC, _PRIMESENSE, _INTEL = "2bc5", "1d27", "8086"
_OPENNI_ASTRAS = {f"04{k:02x}" for k in range(1, 16)}


@dataclass(frozen=True)
class UsbDevice:
    """A USB device: vendor and product in hexadecimal, its product's name and serial number, perhaps empty."""

    vendor: str
    product: str
    name: str
    serial: str

    def kind(self) -> str:
        """Return the kind of source that opens it; "" = none does."""
        match self.vendor, self.product:
            case "045e", "097c":
                return "azure-kinect"
            case "045e", "02c4" | "02d8":
                return "kinect-v2"
            case "045e", "02ae" | "02bf":
                return "openni"
        if self.vendor == _INTEL and "realsense" in self.name.lower():
            return "realsense"
        if self.vendor == _PRIMESENSE or (self.vendor == _ORBBEC and self.product in _OPENNI_ASTRAS):
            return "openni"
        return "orbbec" if self.vendor == _ORBBEC else ""


def usb_devices(folder: Path = USB_DEVICES) -> list[UsbDevice]:
    """Return the USB devices that the system lists; none on other systems than Linux."""
    found = []
    for entry in sorted(folder.glob("*/idVendor")):
        texts = [_text(entry.with_name(name)) for name in ("idVendor", "idProduct", "product", "serial")]
        found.append(UsbDevice(texts[0].lower(), texts[1].lower(), *texts[2:]))
    return found


def seen_without_library(
    kind: str, missing: NotAvailableError, folder: Path = USB_DEVICES
) -> list[FoundDevice]:
    """Return the devices of a kind that the system sees though the kind's library does not work here.

    Args:
        kind: of source.
        missing: the library's error.
        folder: where the system lists USB devices.

    Raises:
        NotAvailableError: none is seen; `missing` itself.
    """
    here = [one for one in usb_devices(folder) if one.kind() == kind]
    if not here:
        raise missing
    return [
        FoundDevice(kind, one.name or kind, camera_name(kind, one.serial or str(number)), one.serial,
                    missing.sentence)
        for number, one in enumerate(here)
    ]  # fmt: skip


def video_devices(folder: Path = VIDEO_DEVICES) -> list[tuple[int, str]]:
    """Return number and name of the video devices that give pictures; none on other systems than Linux.

    If a device has several entries, the first one gives the pictures. Depth cameras have their own sources and are
    left out.
    """
    found = []
    for entry in folder.glob("video*"):
        name, number = _text(entry / "name"), entry.name.removeprefix("video")
        if number.isdigit() and int(number) < 100 and _text(entry / "index") in ("", "0"):
            if not any(word in name.lower() for word in ("realsense", "kinect", "orbbec", "femto", "gemini")):
                found.append((int(number), name or entry.name))
    return sorted(found)


def camera_name(kind: str, which: str) -> str:
    """Return a name for the camera of a device: its kind, and the end of its serial number or its number."""
    plain = "".join(sign for sign in which if sign.isascii() and sign.isalnum())
    return f"{kind}_{plain[-6:]}" if plain else kind


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:  # unplugged meanwhile, or the device does not say
        return ""

"""VMC as Capture Studio sends it (OSC over UDP), read with nothing but Python: for the programs beside this file.

A frame has the 52 bones by their HumanIK names, in right-handed axes with y up, as MotionBuilder and Maya have them:
positions in centimetres from the parent, rotations in the parent's axes, zero in the T-pose.
Source: Open Sound Control 1.0; protocol.vmc.info. To see what comes, without any other program:

    python examples/receivers/vmc.py [PORT]
"""

import math
import socket
import struct
import sys
from collections.abc import Iterator
from typing import NamedTuple

PORT = 39539
_MOST_BYTES = 65_536

_TRUNK = {
    "Hips": "Hips",
    "Spine": "Spine",
    "Chest": "Spine1",
    "UpperChest": "Spine2",
    "Neck": "Neck",
    "Head": "Head",
}
_LIMBS = {
    "Shoulder": "Shoulder", "UpperArm": "Arm", "LowerArm": "ForeArm", "Hand": "Hand",
    "UpperLeg": "UpLeg", "LowerLeg": "Leg", "Foot": "Foot", "Toes": "ToeBase",
}  # fmt: skip
_FINGERS = {"Thumb": "Thumb", "Index": "Index", "Middle": "Middle", "Ring": "Ring", "Little": "Pinky"}
_PHALANGES = ("Proximal", "Intermediate", "Distal")


def _names() -> dict[str, str]:
    names = dict(_TRUNK)
    for side in ("Left", "Right"):
        names |= {side + unity: side + name for unity, name in _LIMBS.items()}
        for unity, name in _FINGERS.items():
            for number, phalanx in enumerate(_PHALANGES, start=1):
                names[f"{side}{unity}{phalanx}"] = f"{side}Hand{name}{number}"
    return names


NAMES = _names()
"""Unity's name of a bone, as VMC has it -> its HumanIK name; parents stand before their children."""


def parent_of(name: str) -> str:
    """Return the HumanIK name of a bone's parent, "" for the hips."""
    trunk = list(_TRUNK.values())
    if name in trunk:
        return trunk[trunk.index(name) - 1] if name != "Hips" else ""
    side = "Left" if name.startswith("Left") else "Right"
    part = name.removeprefix(side)
    if part == "Shoulder":
        return "Spine2"
    if part == "UpLeg":
        return "Hips"
    limbs = list(_LIMBS.values())
    if part in limbs:
        return side + limbs[limbs.index(part) - 1]
    return f"{side}Hand" if part.endswith("1") else name[:-1] + str(int(name[-1]) - 1)


class Bone(NamedTuple):
    """A bone: where it stands from its parent [cm], and its rotation wxyz in the parent's axes."""

    position_cm: tuple[float, float, float]
    rotation_wxyz: tuple[float, float, float, float]


class Frame(NamedTuple):
    """A frame: its time [s], the bones by HumanIK name, and its timecode, "" = none is told."""

    time_s: float
    bones: dict[str, Bone]
    timecode: str


class VmcReader:
    """Puts datagrams together to frames."""

    def __init__(self) -> None:
        self._bones: dict[str, Bone] = {}
        self._timecode = ""
        self.refused = 0

    def feed(self, datagram: bytes) -> Frame | None:
        """Return the frame that this datagram ends, or None. One that is no OSC is counted in `refused`."""
        frame = None
        try:
            for address, values in messages(datagram):
                if address == "/VMC/Ext/Bone/Pos" and len(values) == 8:
                    name, *numbers = values
                    if name in NAMES and all(
                        isinstance(one, float) and math.isfinite(one) for one in numbers
                    ):
                        self._bones[NAMES[name]] = right_handed(numbers)
                elif address == "/studio/timecode" and values:
                    self._timecode = str(values[0])
                elif address == "/VMC/Ext/T" and values:  # it ends a frame
                    frame = Frame(float(values[0]), dict(self._bones), self._timecode)
        except (struct.error, ValueError, IndexError, TypeError):
            self.refused += 1
        return frame


def right_handed(numbers: list[float]) -> Bone:
    """Return a bone of Unity's axes (left-handed, metres, x y z, rotation x y z w) in right-handed ones, in cm."""
    x, y, z, qx, qy, qz, qw = numbers
    return Bone((-100 * x, 100 * y, 100 * z), (qw, qx, -qy, -qz))


def euler_xyz_deg(rotation_wxyz: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Return a rotation as angles about x, y, z [deg], x first: the order "XYZ" of Maya and MotionBuilder."""
    w, x, y, z = rotation_wxyz
    about_x = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    about_y = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    about_z = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return math.degrees(about_x), math.degrees(about_y), math.degrees(about_z)


def messages(packet: bytes) -> Iterator[tuple[str, list]]:
    """Yield the OSC messages of a packet: address and values.

    Raises:
        ValueError, struct.error, IndexError: it is no OSC.
    """
    if not packet.startswith(b"#bundle\0"):
        yield _message(packet)
        return
    at = 16
    while at < len(packet):
        (size,) = struct.unpack_from(">i", packet, at)
        if size <= 0 or at + 4 + size > len(packet):
            raise ValueError("a bundle that is cut")
        yield from messages(packet[at + 4 : at + 4 + size])
        at += 4 + size


def _message(packet: bytes) -> tuple[str, list]:
    address, at = _text(packet, 0)
    types, at = _text(packet, at)
    values: list[str | float | int] = []
    for kind in types[1:]:
        if kind == "s":
            text, at = _text(packet, at)
            values.append(text)
        elif kind in "fi":
            values.append(struct.unpack_from(">" + kind, packet, at)[0])
            at += 4
        else:
            raise ValueError(f"an argument of type {kind}")
    return address, values


def _text(packet: bytes, at: int) -> tuple[str, int]:
    end = packet.index(b"\0", at)
    return packet[at:end].decode("utf-8"), end + 4 - end % 4


def listen(port: int = PORT, host: str = "127.0.0.1") -> socket.socket:
    """Return a socket that hears VMC and does not wait: `newest` reads it."""
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    channel.bind((host, port))
    channel.setblocking(False)
    return channel


def newest(channel: socket.socket, reader: VmcReader) -> Frame | None:
    """Read all that waits in a socket; return the last whole frame, None where there is none."""
    frame = None
    while True:
        try:
            frame = reader.feed(channel.recv(_MOST_BYTES)) or frame
        except BlockingIOError:
            return frame


def main(port: int) -> None:
    reader, channel = VmcReader(), listen(port)
    channel.setblocking(True)
    while True:
        if frame := reader.feed(channel.recv(_MOST_BYTES)):
            hips = frame.bones.get("Hips")
            print(
                f"{frame.time_s:8.2f} s {frame.timecode} hips {hips and [round(v, 1) for v in hips.position_cm]} cm"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else PORT)

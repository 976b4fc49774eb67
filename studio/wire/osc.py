"""OSC packets, read strictly: a damaged packet is refused as a whole, without a line in the log.

python-osc logs a line for each argument that it does not know, which a hostile sender could fill a disk with.
Source: Open Sound Control 1.0.
"""

import struct
from dataclasses import dataclass

_NUMBERS = {"f": ">f", "i": ">i", "d": ">d", "h": ">q"}
_MOST_MESSAGES, _MOST_ARGUMENTS = 256, 32


class NotOscError(Exception):
    """A packet is not OSC."""


@dataclass(frozen=True)
class OscMessage:
    """A message: its address and its arguments; an argument that is neither text nor number is None."""

    address: str
    arguments: tuple[str | float | None, ...]


def osc_messages(packet: bytes) -> list[OscMessage]:
    """Return the messages of a packet, which may be a bundle; a bundle within it is left out.

    Raises:
        NotOscError: it is not OSC.
    """
    try:
        if not packet.startswith(b"#bundle\0"):
            return [_message(packet)]
        found, at = [], 16
        while at < len(packet):
            (size,) = struct.unpack_from(">i", packet, at)
            part = packet[at + 4 : at + 4 + size]
            if size <= 0 or len(part) < size or len(found) >= _MOST_MESSAGES:
                raise NotOscError
            if not part.startswith(b"#"):
                found.append(_message(part))
            at += 4 + size
        return found
    except (struct.error, ValueError) as error:
        raise NotOscError from error


def _message(packet: bytes) -> OscMessage:
    address, at = _text(packet, 0)
    kinds, at = _text(packet, at) if at < len(packet) else (",", at)  # old senders leave it out
    if not address.startswith("/") or not kinds.startswith(",") or len(kinds) > _MOST_ARGUMENTS:
        raise NotOscError
    arguments: list[str | float | None] = []
    for kind in kinds[1:]:
        if kind == "s":
            text, at = _text(packet, at)
            arguments.append(text)
        elif kind in _NUMBERS:
            arguments.append(float(struct.unpack_from(_NUMBERS[kind], packet, at)[0]))
            at += struct.calcsize(_NUMBERS[kind])
        elif kind in "TFNI":
            arguments.append(None)
        else:
            raise NotOscError
    return OscMessage(address, tuple(arguments))


def _text(packet: bytes, at: int) -> tuple[str, int]:
    end = packet.index(b"\0", at)
    return packet[at:end].decode("utf-8"), end + 4 - end % 4

"""Art-Net timecode: the packet ArtTimeCode over UDP.

Source: Art-Net 4 Protocol Release V1.4, Artistic Licence: `Art-Net\\0`, operation 0x9700 (low byte first), protocol
version 14 (high byte first), filler, stream, frames, seconds, minutes, hours, type (0 film, 1 EBU, 2 drop-frame,
3 SMPTE). Port 6454.
"""

from studio.engine.timecode.timecode import TimecodeRate

PORT = 6454
_HEAD = b"Art-Net\0\x00\x97"
_LENGTH = 19
_COUNTS = (24, 25, 30, 30)


def frame_of_packet(data: bytes, rate: TimecodeRate) -> int | None:
    """Return the frame since midnight in a packet; None if it is no timecode of this rate."""
    if len(data) < _LENGTH or data[:10] != _HEAD or int.from_bytes(data[10:12], "big") < 14:
        return None
    frames, seconds, minutes, hours, kind = data[14:19]
    if kind > 3 or _COUNTS[kind] * rate.ltc_frames != rate.count or (kind == 2) != rate.drop:
        return None
    return rate.frame(hours, minutes, seconds, frames * rate.ltc_frames)

"""MIDI timecode (MTC): quarter frames and full frames among the bytes of a MIDI device.

Source: MIDI Time Code, MMA/AMEI 4.2.1, 1987: `F1 0nnndddd` eight times in two frames, from the frame's lowest digit
to the hour with the rate; `F0 7F id 01 01 hh mm ss ff F7` after a jump. Eight quarters give the time of the first.
"""

from studio.engine.timecode.timecode import TimecodeRate

_COUNTS = (24, 25, 30, 30)
_FULL = 10
_LONGEST = 64


def _frame(rate: TimecodeRate, hours: int, minutes: int, seconds: int, frames: int) -> int | None:
    """Return the frame of MTC's numbers; None where the device runs at another rate."""
    kind, hours = hours >> 5 & 3, hours & 31
    if _COUNTS[kind] * rate.ltc_frames != rate.count or (kind == 2) != rate.drop:
        return None
    return rate.frame(hours, minutes, seconds, frames * rate.ltc_frames)


class MtcDecoder:
    """Decodes MIDI bytes as they arrive.

    Args:
        rate: of the timecode. MTC knows 24, 25, 29.97 drop-frame and 30; 23.976 and 29.97 go as 24 and 30.
    """

    def __init__(self, rate: TimecodeRate) -> None:
        self._rate = rate
        self._quarters: list[int] = []
        self._first_ns = 0
        self._message = bytearray()
        self.refused = 0

    def feed(self, data: bytes, time_ns: int) -> list[tuple[int, int]]:
        """Return the frames that these bytes complete: the time at which each began [ns], and its number since
        midnight.

        Args:
            data: bytes, in any pieces.
            time_ns: their arrival [ns].
        """
        found = []
        for byte in data:
            if byte >= 0xF8:  # clock and active sensing may arrive anywhere
                continue
            if byte >= 0x80 and byte != 0xF7:
                self._message = bytearray([byte])
            elif self._message:
                self._message.append(byte)
            reading = self._ended(time_ns)
            if reading is not None:
                found.append(reading)
            if len(self._message) > _LONGEST:
                self._message.clear()
        return found

    def _ended(self, time_ns: int) -> tuple[int, int] | None:
        message = self._message
        if len(message) == 2 and message[0] == 0xF1:
            piece = message[1]
            message.clear()
            return self._quarter(piece, time_ns)
        if message[:1] == b"\xf0" and message[-1:] == b"\xf7":
            whole = bytes(message)
            message.clear()
            if len(whole) == _FULL and whole[1] == 0x7F and whole[3:5] == b"\x01\x01":
                self._quarters = []
                return self._reading(time_ns, _frame(self._rate, *whole[5:9]))
        return None

    def _quarter(self, piece: int, time_ns: int) -> tuple[int, int] | None:
        number, digit = piece >> 4, piece & 15
        if number != len(self._quarters):
            self._quarters = []
            if number:
                return None
        if number == 0:
            self._first_ns = time_ns
        self._quarters.append(digit)
        if number < 7:
            return None
        frames, seconds, minutes, hours = (
            self._quarters[k] | self._quarters[k + 1] << 4 for k in range(0, 8, 2)
        )
        self._quarters = []
        return self._reading(self._first_ns, _frame(self._rate, hours & 0x7F, minutes, seconds, frames))

    def _reading(self, time_ns: int, frame: int | None) -> tuple[int, int] | None:
        if frame is None:
            self.refused += 1
            return None
        return time_ns, frame

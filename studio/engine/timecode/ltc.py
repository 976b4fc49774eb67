"""Decoder of linear timecode (LTC), which arrives as sound.

Source: SMPTE ST 12-1:2014, section 9: 80 bits a frame in biphase mark, the least bit first, closed by the sync word
0011111111111101. A bit begins with a transition; a one has another in its middle.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.timecode.timecode import TimecodeRate

BITS = 80
_MIDDLE_HZ = 27.0
"""Words per second between the slowest and the fastest rate; the decoder starts from it."""

_HYSTERESIS, _DECAY_S = 0.3, 1.0
_N, _LEVEL, _PEAK, _LAST, _PERIOD, _HALF, _GOOD, _WORD, _AT, _ZERO, _BEFORE, _START, _BACK = range(13)
"""Places in the state: sample number, side (-1, 1), peak, last transition, bit period [samples], a half bit waits,
good bits in a row, last 16 bits, place in the ring, last zero crossing, sample before, period at the start,
whether the last sync word ran backwards."""


@compiled
def _decode(
    samples: NDArray[np.float32],
    state: NDArray[np.float64],
    bits: NDArray[np.uint8],
    begins: NDArray[np.float64],
    decay: float,
    words: NDArray[np.uint8],
    times: NDArray[np.float64],
) -> int:
    """Fill `words` (n, 80) and `times` (n,), the sample at which each begins; return their number."""
    found = 0
    for x in samples:
        n = state[_N]
        state[_N] += 1.0
        state[_PEAK] = max(abs(x), state[_PEAK] * decay)
        before = state[_BEFORE]
        state[_BEFORE] = x
        if (x >= 0.0) != (before >= 0.0):
            state[_ZERO] = n - 1.0 + before / (before - x)
        level = _HYSTERESIS * state[_PEAK]
        if (state[_LEVEL] < 0.0 and x > level) or (state[_LEVEL] >= 0.0 and x < -level):
            state[_LEVEL] = 1.0 if x > 0.0 else -1.0
            now, begin = state[_ZERO], state[_LAST]
            length = now - begin
            state[_LAST] = now
            period = state[_PERIOD]
            bit = -1
            if length < 0.2 * period or length > 1.4 * period:
                state[_GOOD], state[_HALF] = 0.0, 0.0
            elif length > 0.75 * period:
                if state[_HALF] > 0.0:  # a single half bit: the bits before were out of step
                    state[_GOOD], state[_HALF] = 0.0, 0.0
                bit = 0
            elif state[_HALF] > 0.0:
                begin, bit = state[_HALF], 1
                state[_HALF] = 0.0
            else:
                state[_HALF] = begin
            if bit >= 0:
                period += 0.05 * (now - begin - period)
                state[_PERIOD] = min(max(period, 0.7 * state[_START]), 1.3 * state[_START])
                at = int(state[_AT])
                bits[at], begins[at] = bit, begin
                state[_AT] = (at + 1) % 80
                state[_GOOD] += 1.0
                word = (int(state[_WORD]) * 2 + bit) % 65536
                state[_WORD] = word
                if word == 0xBFFC and state[_GOOD] >= 80.0:  # the sync word, its last bit first
                    state[_BACK] = 1.0
                if word == 0x3FFD and state[_GOOD] >= 80.0 and found < len(times):
                    times[found] = begins[(at + 1) % 80]
                    for k in range(80):
                        words[found, k] = bits[(at + 1 + k) % 80]
                    found += 1
                    state[_BACK] = 0.0
    return found


class LtcDecoder:
    """Decodes a stream of samples, piece by piece, forwards.

    Args:
        rate: of the timecode.
        sample_hz: of the sound, at least 16,000 [Hz].
    """

    def __init__(self, rate: TimecodeRate, sample_hz: float) -> None:
        self._rate = rate
        self._decay = float(np.exp(-1.0 / (_DECAY_S * sample_hz)))
        self._state = np.zeros(13)
        self._state[_PERIOD] = self._state[_START] = sample_hz / (_MIDDLE_HZ * BITS)
        self._bits = np.zeros(BITS, np.uint8)
        self._begins = np.zeros(BITS)
        self._most_per_sample = 1.5 * 30.0 / sample_hz
        self.refused = 0

    @property
    def backwards(self) -> bool:
        """Whether timecode runs backwards, as from a recorder that rewinds; it is then not read."""
        return bool(self._state[_BACK])

    def feed(self, samples: NDArray[np.float32]) -> list[tuple[float, int]]:
        """Return the words that end in these samples: the sample number at which each begins, counted from the first
        sample of all, and its frame since midnight. Words that are no timecode of the rate are counted in `refused`.

        Args:
            samples: one channel, shape (sample_count,); values beyond full scale, 1, are clipped, and NaN counts as
                silence, so that a damaged sample does not stop the decoder.
        """
        room = 2 + int(len(samples) * self._most_per_sample)
        words, times = np.zeros((room, BITS), np.uint8), np.zeros(room)
        given = np.nan_to_num(np.clip(np.ascontiguousarray(samples, np.float32), -1.0, 1.0))
        count = _decode(given, self._state, self._bits, self._begins, self._decay, words, times)
        found = []
        for word, time in zip(words[:count], times[:count], strict=True):
            frame = frame_of_word(word, self._rate)
            if frame is None:
                self.refused += 1
            else:
                found.append((float(time), frame))
        return found


_WEIGHTS = np.array([1, 2, 4, 8])


def _digit(word: NDArray[np.uint8], at: int, bits: int) -> int:
    return int(word[at : at + bits] @ _WEIGHTS[:bits])


def numbers_of_word(word: NDArray[np.uint8]) -> tuple[int, int, int, int, bool] | None:
    """Return hours, minutes, seconds, frames and the drop-frame flag of a word, shape (80,); None: no digits."""
    tens = [_digit(word, at, bits) for at, bits in ((56, 2), (40, 3), (24, 3), (8, 2))]
    ones = [_digit(word, at, 4) for at in (48, 32, 16, 0)]
    if max(ones) > 9:
        return None
    hours, minutes, seconds, frames = (10 * ten + one for ten, one in zip(tens, ones, strict=True))
    return hours, minutes, seconds, frames, bool(word[10])


def frame_of_word(word: NDArray[np.uint8], rate: TimecodeRate) -> int | None:
    """Return the frame since midnight of a word of LTC, shape (80,); None where it is no timecode of this rate."""
    numbers = numbers_of_word(word)
    if numbers is None or numbers[4] != rate.drop:
        return None
    hours, minutes, seconds, frames, _ = numbers
    return rate.frame(hours, minutes, seconds, frames * rate.ltc_frames)

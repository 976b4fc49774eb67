"""Linear timecode as sound, for the tests: written from SMPTE ST 12-1, with the faults of a film set."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.timecode.timecode import Timecode, TimecodeRate

SYNC = [int(sign) for sign in "0011111111111101"]


def word(timecode: Timecode) -> list[int]:
    """The 80 bits of a frame, or of the pair of frames that it begins, in transmission order."""
    hours, minutes, seconds, frames = timecode.parts
    frames //= timecode.rate.ltc_frames
    bits = [0] * 64
    for value, ones, tens, tens_bits in (
        (frames, 0, 8, 2), (seconds, 16, 24, 3), (minutes, 32, 40, 3), (hours, 48, 56, 2)
    ):  # fmt: skip
        for k in range(4):
            bits[ones + k] = value % 10 >> k & 1
        for k in range(tens_bits):
            bits[tens + k] = value // 10 >> k & 1
    bits[10] = int(timecode.rate.drop)
    return bits + SYNC


def sound(
    frames: NDArray[np.int64],
    rate: TimecodeRate,
    sample_hz: float = 48_000.0,
    *,
    noise_db: float | None = None,
    wow: float = 0.0,
    wow_hz: float = 0.6,
    drop_outs_s: tuple[tuple[float, float], ...] = (),
    ppm: float = 0.0,
    seed: int = 1,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return the sound of these frames in a row, and when each begins in it [s].

    Above 30 frames a second, frames form pairs: `frames` has the numbers of the even and the odd ones.

    Args:
        noise_db: level of white noise, relative to the signal.
        wow: largest relative error of the speed, which swings at `wow_hz`.
        drop_outs_s: spans without signal, with noise alone.
        ppm: how much faster timecode runs than the sound's clock.
    """
    rng = np.random.default_rng(seed)
    pairs = frames[:: rate.ltc_frames]
    bits = np.concatenate([word(Timecode(int(frame), rate)) for frame in pairs])
    seconds = len(pairs) * rate.ltc_frames / rate.fps
    t = np.arange(int(seconds * sample_hz) + 1) / sample_hz
    swing = wow / (2 * np.pi * wow_hz)
    played = t * (1 + ppm * 1e-6) + swing * np.sin(2 * np.pi * wow_hz * t)  # place on the tape [s]
    halves = played * rate.fps / rate.ltc_frames * 80 * 2
    place = np.minimum(halves.astype(int), 2 * len(bits) - 1)
    # a transition at the beginning of every bit, and in the middle of a one
    turns = np.ones(2 * len(bits), int)
    turns[1::2] = bits
    level = np.cumsum(turns)[place] % 2 * 2.0 - 1.0
    level = np.convolve(level, np.ones(3) / 3, mode="same")  # rise time of about 40 us
    for begin, end in drop_outs_s:
        level[(t >= begin) & (t < end)] = 0.0
    if noise_db is not None:
        level = level + rng.normal(0.0, 10 ** (noise_db / 20), len(level))
    begins = np.interp(np.arange(len(frames)) / rate.fps, played, t)
    return (0.5 * level).astype(np.float32), begins

"""Videos with sound for tests: what several cameras see and hear of one scene, each from its own beginning on."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.audio.stream import AudioStream
from numpy.typing import NDArray
from scipy.signal import lfilter, oaconvolve

RATE_HZ = 48_000
CODECS = {".mp4": "aac", ".mov": "pcm_s16le", ".mkv": "libopus"}
Array = NDArray[np.float64]


def voices(length_s: float, seed: int = 0) -> Array:
    """Noise that swells and fades as voices do."""
    rng = np.random.default_rng(seed)
    count = int(length_s * RATE_HZ)
    noise = lfilter([1.0], [1.0, -0.9], rng.normal(size=count))
    swell = np.abs(rng.normal(size=count // 6000 + 2))
    return 0.03 * noise * np.interp(np.arange(count), np.arange(len(swell)) * 6000, swell)


def claps(length_s: float, at_s: list[float], seed: int = 0) -> Array:
    """Quiet noise with claps."""
    rng = np.random.default_rng(seed)
    out = 0.001 * rng.normal(size=int(length_s * RATE_HZ))
    for second in at_s:
        begin = round(second * RATE_HZ)
        part = out[begin : begin + RATE_HZ // 5]
        part += 0.7 * rng.normal(size=len(part)) * np.exp(-np.arange(len(part)) / (0.012 * RATE_HZ))
    return out


def heard(
    scene: Array, start_s: float, length_s: float, *, seed: int, noise: float = 0.005, drift: float = 0.0
) -> Array:
    """What a microphone hears of a scene: its own room, its own noise.

    Args:
        scene: at `RATE_HZ`.
        start_s: when the camera begins. drift: how much faster the scene's clock runs than the camera's.
    """
    rng = np.random.default_rng(seed)
    times = start_s * RATE_HZ + np.arange(int(length_s * RATE_HZ)) * (1.0 + drift)
    direct = np.interp(times, np.arange(len(scene)), scene)
    room = np.concatenate(
        [[1.0], np.zeros(200), 0.03 * rng.normal(size=4000) * np.exp(-np.arange(4000) / 1500)]
    )
    return oaconvolve(direct, room)[: len(direct)] + noise * rng.normal(size=len(direct))


def write_film(
    path: Path,
    length_s: float,
    sound: Array | None = None,
    *,
    frames_per_second: Fraction = Fraction(25),
    timecode: str = "",
    created: str = "",
    pictures: list[NDArray[np.uint8]] | None = None,
) -> Path:
    """Write a video with a sound track: AAC in .mp4, uncompressed in .mov, Opus in .mkv; all silent where None."""
    rate = frames_per_second
    with av.open(str(path), "w") as container:
        if created:
            container.metadata["creation_time"] = created
        video = container.add_stream("mpeg4", rate=rate)
        if timecode:
            video.metadata["timecode"] = timecode
        grey = [np.full((48, 64, 3), 40 + 20 * k, np.uint8) for k in range(4)]
        shown = pictures or grey
        video.height, video.width = shown[0].shape[:2]
        video.pix_fmt, video.bit_rate = "yuv420p", 8_000_000 if pictures else 100_000
        audio = None
        if sound is not None:
            audio = container.add_stream(CODECS[path.suffix], rate=RATE_HZ, layout="mono")
            assert isinstance(audio, AudioStream)
        count = len(pictures) if pictures else round(length_s * rate)
        for k in range(count):
            frame = av.VideoFrame.from_ndarray(shown[k % len(shown)], format="rgb24")
            frame.pts, frame.time_base = k, 1 / rate
            container.mux(video.encode(frame))
        container.mux(video.encode())
        if audio is not None and sound is not None:
            samples = np.clip(sound * 32767, -32768, 32767).astype(np.int16)
            for begin in range(0, len(samples), RATE_HZ):
                part = av.AudioFrame.from_ndarray(
                    samples[None, begin : begin + RATE_HZ], format="s16", layout="mono"
                )
                part.sample_rate, part.pts, part.time_base = RATE_HZ, begin, Fraction(1, RATE_HZ)
                container.mux(audio.encode(part))
            container.mux(audio.encode())
    return path

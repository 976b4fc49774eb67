"""Small video files for tests, from real pictures."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tests.engine.seeing.pictures.videos import pictures_of

TURNED_TO_THE_RIGHT = (0, 1 << 16, 0, -(1 << 16) & 0xFFFFFFFF, 0, 0, 0, 0, 1 << 30)
"""The matrix of a phone's film that is to be turned by a quarter, clockwise."""


def real_pictures(
    folder: Path, name: str, count: int, *, every: int = 1, small: int = 3
) -> list[NDArray[np.uint8]]:
    """Pictures of a real video, reduced."""
    pictures = pictures_of(folder / f"{name}.mp4", every=every, count=count)
    return [np.asarray(Image.fromarray(picture).reduce(small)) for picture in pictures]


def write_video(
    path: Path,
    pictures: Sequence[NDArray[np.uint8]],
    times_ms: Sequence[int] | None = None,
    *,
    tags: dict[str, str] | None = None,
    options: dict[str, str] | None = None,
    gop: int = 12,
) -> Path:
    """Write pictures as a video; by default at 30 frames a second."""
    times_ms = times_ms or [round(k * 1000 / 30) for k in range(len(pictures))]
    with av.open(str(path), "w", options=options or {}) as container:
        container.metadata.update(tags or {})
        stream = container.add_stream("libvpx" if path.suffix == ".webm" else "mpeg4", rate=1000)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.bit_rate = "yuv420p", 8_000_000
        stream.time_base, stream.gop_size = Fraction(1, 1000), gop
        for picture, time_ms in zip(pictures, times_ms, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = time_ms, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def turn(path: Path) -> None:
    """Let an .mp4 say that it is to be turned by a quarter, clockwise, as phones do."""
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40  # version 0: the matrix comes after 40 bytes
    data[at : at + 36] = b"".join(value.to_bytes(4, "big") for value in TURNED_TO_THE_RIGHT)
    path.write_bytes(data)

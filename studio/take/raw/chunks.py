"""Reader of a chunk of a `raw.mcap`, which may be damaged or hostile; its unpacked size is limited."""

import zstandard
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import breakup_chunk

from studio.engine.base.sentences import say

MAX_CHUNK_BYTES = 256 << 20
"""Largest chunk; the writer closes a chunk at 0.25 MB."""


def open_chunk(chunk: Chunk) -> list[McapRecord]:
    """Return the records in a chunk.

    Raises:
        ValueError: it is too large when unpacked, or not packed by zstd.
        Others: see `reader.DAMAGE`.
    """
    if chunk.compression not in ("", "zstd"):
        raise ValueError(
            say(
                "raw.packed_by",
                "a chunk packed by {by!r}; this program packs by zstd",
                by=chunk.compression[:20],
            )
        )
    size = chunk.uncompressed_size
    if chunk.compression == "zstd":  # a frame that states its size is unpacked regardless of the given bound
        size = max(size, zstandard.frame_content_size(chunk.data))
    if size > MAX_CHUNK_BYTES:
        raise ValueError(
            say(
                "raw.chunk_size",
                "a chunk of {n} bytes once unpacked; {most} are allowed",
                n=size,
                most=MAX_CHUNK_BYTES,
            )
        )
    return breakup_chunk(chunk, validate_crc=True)

"""Opening a chunk of a `raw.mcap`, which may be damaged or made to do harm: nothing grows beyond what it says."""

import zstandard
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import breakup_chunk

MAX_CHUNK_BYTES = 256 << 20
"""The writer closes a chunk at 0.25 MB."""


def open_chunk(chunk: Chunk) -> list[McapRecord]:
    """Return the records in a chunk.

    Raises:
        ValueError: it is larger than a chunk may be once unpacked, or packed otherwise than by zstd.
        Also whatever `raw_reader.DAMAGE` lists.
    """
    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"a chunk packed by {chunk.compression[:20]!r}; this program packs by zstd")
    size = chunk.uncompressed_size
    if chunk.compression == "zstd":  # a frame that tells its size is unpacked whatever bound is given
        size = max(size, zstandard.frame_content_size(chunk.data))
    if size > MAX_CHUNK_BYTES:
        raise ValueError(f"a chunk of {size} bytes once unpacked; {MAX_CHUNK_BYTES} are allowed")
    return breakup_chunk(chunk, validate_crc=True)

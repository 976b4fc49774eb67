"""Small files that would grow without end: ZIP, MCAP, npz, bags. Each is refused before it has grown."""

import io
import json
import struct
import tracemalloc
import zipfile
from contextlib import contextmanager

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from studio import wire
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.model.poses import Poses
from studio.engine.whole_take.trace import Trace
from studio.take.folder.new import new_take
from studio.take.importers import bag_files
from studio.take.library import bundle as bundles
from studio.take.library.bundle import read_bundle, write_bundle
from studio.take.raw import chunks as raw_chunks
from studio.take.raw.append import scan_raw
from studio.take.raw.reader import RawReader
from tests.refused import refused

ZEROS = bytes(1 << 20)
MB = 1 << 20


@contextmanager
def little_memory(limit_bytes: int = 64 * MB):
    """The block does not take more memory than this."""
    tracemalloc.start()
    try:
        yield
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < limit_bytes, f"{peak >> 20} MB"


@pytest.fixture
def meta(tmp_path):
    """The `take.json` of a take."""
    with new_take(tmp_path / "made", source="live") as take:
        pass
    return (take.path / "take.json").read_text()


def zip_of(*files: tuple[str, int], meta: str) -> io.BytesIO:
    """A take as one file with these names, each so many MB of zeros."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("take.json", meta)
        for name, size_mb in files:
            with made.open(name, "w") as file:
                for _ in range(size_mb):
                    file.write(ZEROS)
    return out


@pytest.mark.parametrize("name", ["raw.mcap", "solves/a/poses.npz", "references/truth.csv"])
def test_a_zip_that_grows_a_thousand_times(tmp_path, meta, name):
    with refused(FormatError, "bundle.grows"):
        read_bundle(zip_of((name, 300), meta=meta), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_zip_whose_take_json_is_endless(tmp_path, meta):
    endless = meta.rstrip().removesuffix("}") + " " * (60 * MB) + "}"
    packed = zip_of(meta=endless)
    del endless
    with little_memory(), refused(FormatError, "bundle.larger_than_said"):
        read_bundle(packed, tmp_path / "out")


def test_a_take_that_the_disk_has_no_room_for(tmp_path, meta, monkeypatch):
    monkeypatch.setattr(bundles, "KEPT_FREE_BYTES", 1 << 60)
    with refused(StudioError, "bundle.no_space"):
        read_bundle(zip_of(("raw.mcap", 1), meta=meta), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_honest_take_passes(tmp_path):
    with new_take(tmp_path / "one", source="live") as take:
        (take.path / "references").mkdir()
        (take.path / "references" / "still.csv").write_text("time_s\n" + "0,0,0,1\n" * 100_000)
    write_bundle(take, tmp_path / "one.take.zip")
    assert (read_bundle(tmp_path / "one.take.zip", tmp_path / "two").path / "references/still.csv").is_file()


def chunk(data: bytes, claimed: int, compression: bytes = b"zstd") -> bytes:
    """A chunk record of MCAP."""
    body = struct.pack("<QQQI", 0, 0, claimed, 0)
    body += struct.pack("<I", len(compression)) + compression + struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", 6, len(body)) + body


def mcap_with(path, record: bytes):
    """A `raw.mcap` with a camera, and this record behind it."""
    with open(path, "wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start()
        writer.finish()
    whole = path.read_bytes()
    end = 8 + 9 + struct.unpack_from("<Q", whole, 9)[0]
    path.write_bytes(whole[:end] + record)
    return path


@pytest.mark.parametrize("claimed", [200 * MB, 2**40, 100], ids=["honest", "huge", "understated"])
def test_a_chunk_that_grows_a_thousand_times(tmp_path, monkeypatch, claimed):
    monkeypatch.setattr(raw_chunks, "MAX_CHUNK_BYTES", 8 * MB)
    packed = zstandard.ZstdCompressor().compress(bytes(200 * MB))
    path = mcap_with(tmp_path / "raw.mcap", chunk(packed, claimed))
    reader = RawReader(path)
    with little_memory():
        assert list(reader) == []
        scan_raw(path)
    assert "chunk" in reader.problem and not reader.complete


def test_a_chunk_of_another_packing(tmp_path):
    path = mcap_with(tmp_path / "raw.mcap", chunk(b"\x04\x22\x4d\x18" + b"\0" * 30, 2**40, b"lz4"))
    reader = RawReader(path)
    assert list(reader) == [] and "packs by zstd" in reader.problem


def test_a_depth_image_that_grows():
    packed = zstandard.ZstdCompressor().compress(bytes(200 * MB))
    small = wire.Preview(0, 80, 60, 4, packed)
    with little_memory(), pytest.raises(FormatError):
        wire.preview_array(small)


@pytest.mark.parametrize(("load", "code"), [(Poses.load, "poses.not_npz"), (Trace.load, "trace.damaged")])
def test_arrays_that_grow_a_thousand_times(tmp_path, load, code):
    path = tmp_path / "poses.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made, made.open("time_s.npy", "w") as file:
        for _ in range(300):
            file.write(ZEROS)
    with little_memory(), refused(FormatError, code):
        load(path)


@pytest.mark.parametrize("load", [Poses.load, Trace.load])
def test_arrays_that_claim_to_be_huge(tmp_path, load):
    header = json.dumps(dict(descr="<f8", fortran_order=False, shape=[2**44])).replace("false", "False")
    header = header.replace("[", "(").replace("]", ",)").replace('"', "'").ljust(117) + "\n"
    data = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + bytes(64)
    path = tmp_path / "poses.npz"
    with zipfile.ZipFile(path, "w") as made:
        for key in ("time_s", "time_ns"):
            made.writestr(f"{key}.npy", data)
    with pytest.raises(FormatError):
        load(path)


def test_arrays_with_objects_are_refused(tmp_path):
    path = tmp_path / "poses.npz"
    np.savez(path, time_s=np.array([{"a": 1}], dtype=object))
    with refused(
        FormatError, "poses.not_npz", error="Object arrays cannot be loaded when allow_pickle=False"
    ):
        Poses.load(path)


@pytest.mark.parametrize("kind", ["bz2", "lz4"])
def test_a_bag_that_grows(monkeypatch, kind):
    import bz2

    import lz4.frame

    monkeypatch.setattr(bag_files, "_RECORD_BYTES_LIMIT", 4 * MB)
    packed = {"bz2": bz2, "lz4": lz4.frame}[kind].compress(bytes(64 * MB))
    with little_memory(16 * MB), pytest.raises(ValueError, match="once unpacked"):
        bag_files._unpack(kind.encode(), packed)
    assert bag_files._unpack(kind.encode(), {"bz2": bz2, "lz4": lz4.frame}[kind].compress(b"abc")) == b"abc"

"""Arrays written to a `.npz` are read back, whatever their type and memory layout."""

import mmap

import numpy as np
import pytest

from studio.engine.base import arrays, records
from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.records import Records
from studio.engine.base.versions import TRACE

VALUES = {
    "number": np.int64(7),
    "text": "hips",
    "names": np.array(["a", "bc"]),
    "none": np.zeros((0, 3)),
    "many": np.arange(60.0).reshape(10, 2, 3),
    "other_order": np.asfortranarray(np.arange(12).reshape(3, 4)),
    "column": np.zeros(5, np.dtype([("a", "i2"), ("b", "f4", (2,))]))["b"],
    "every_second": np.arange(20)[::2],
}


@pytest.mark.parametrize("piece", [1, 100, 1 << 20])
def test_they_come_back(tmp_path, monkeypatch, piece):
    monkeypatch.setattr(arrays, "PIECE_BYTES", piece)
    with open(tmp_path / "a.npz", "wb") as file:
        save_arrays(file, VALUES, TRACE)
    found = read_arrays(tmp_path / "a.npz", list(VALUES), TRACE)
    for key, value in VALUES.items():
        np.testing.assert_array_equal(found[key], value)
        assert found[key].dtype == np.asarray(value).dtype


def test_a_mapped_array_holds_what_it_held(tmp_path, monkeypatch):
    monkeypatch.setattr(records, "IN_MEMORY_BYTES", 0)
    kept = Records(np.dtype([("n", "i8"), ("x", "f8", (3,))]))
    for n in range(2000):
        kept.add((n, (n, 0.5, -n)))
    found = kept.all()
    assert isinstance(found.base, mmap.mmap)
    found["n"][5] = 77
    with open(tmp_path / "a.npz", "wb") as file:
        save_arrays(file, {"n": found["n"], "x": found["x"]}, TRACE)
    expected = np.arange(2000)
    expected[5] = 77
    assert np.array_equal(found["n"], expected)
    read = read_arrays(tmp_path / "a.npz", ["n", "x"], TRACE)
    assert np.array_equal(read["n"], expected) and np.array_equal(read["x"][:, 2], -np.arange(2000.0))

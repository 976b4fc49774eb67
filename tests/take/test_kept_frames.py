"""Frames that are kept on disk are read back unchanged."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base import records
from studio.engine.base.errors import TakeError
from studio.engine.base.records import BLOCK, Records
from studio.engine.model.frames import CameraFrame, HandSeen
from studio.take.raw.kept_frames import Joined, KeptFrames, several_bodies
from tests.refused import refused


def frames(count=3 * BLOCK + 7):
    rng = np.random.default_rng(1)
    for k in range(count):
        positions = rng.normal(size=(21, 3))
        positions[k % 21] = np.nan
        hands = tuple(HandSeen(side, "shape", rng.random()) for side in ("left", "right")[: k % 3])
        head = tuple(rng.normal(size=4).tolist()) if k % 2 else None
        frame = CameraFrame(f"camera_{k % 3}", k, 2**61 + k, positions, rng.random(21), hands, head)
        others = tuple(replace(frame, positions=positions + one, body=one) for one in range(1, 1 + k % 4))
        yield replace(frame, body=7, others=others)


def assert_equal(a, b):
    np.testing.assert_array_equal(a.positions, b.positions)
    np.testing.assert_array_equal(a.confidence, b.confidence)
    assert len(a.others) == len(b.others) and a.body == b.body
    for one, other in zip(a.others, b.others, strict=True):
        assert_equal(one, other)
    assert [getattr(a, key) for key in ("camera", "sequence", "device_time_ns", "hands", "head_wxyz")] == [
        getattr(b, key) for key in ("camera", "sequence", "device_time_ns", "hands", "head_wxyz")
    ]


@pytest.mark.parametrize("in_memory", [0, 1 << 24])
def test_frames_come_back_as_they_were(monkeypatch, in_memory):
    monkeypatch.setattr(records, "IN_MEMORY_BYTES", in_memory)
    added, kept = list(frames()), KeptFrames()
    places = np.array([kept.add(frame) for frame in added])
    order = np.random.default_rng(2).permutation(len(added))
    times = np.array([added[place].device_time_ns for place in order])
    chosen = kept.frames(places[order], times)
    assert several_bodies({"camera_0": chosen})
    assert len(chosen) == len(added)
    for frame, place in zip(chosen, order, strict=True):
        assert_equal(frame, added[place])
    assert_equal(chosen[-1], added[order[-1]])
    part = kept.frames(places[order[5:9]], times[:4])
    assert [f.sequence for f in part[1:3]] == [added[order[i]].sequence for i in (6, 7)]
    assert part[0].device_time_ns == times[0]


def test_a_frame_can_be_changed_without_changing_another():
    kept = KeptFrames()
    for frame in frames(4):
        kept.add(frame)
    places = np.arange(4)
    first = kept.frames(places, places)[0]
    first.positions[:] = 0.0
    assert not (kept.frames(places, places)[1].positions == 0.0).any()


def test_joined_sequences_are_one():
    a, b = list(frames(5)), list(frames(3))
    joined = Joined([a, [], b])
    assert len(joined) == 8
    assert list(joined) == [*a, *b] == [joined[i] for i in range(8)]
    assert joined[-1] is b[-1] and joined[4:6] == [a[4], b[0]]
    with pytest.raises(IndexError):
        joined[8]
    assert list(Joined([])) == []


def test_records_are_read_while_they_are_added(monkeypatch):
    monkeypatch.setattr(records, "IN_MEMORY_BYTES", 4096)
    kept = Records(np.dtype([("n", "i8"), ("values", "f4", (3,))]))
    for n in range(2 * BLOCK + 10):
        kept.add((n, (n, 0.5, np.nan)))
        if n % 100 == 0:
            assert kept.read(n, n + 5)["n"].tolist() == [n]
    assert kept.read(0, len(kept))["n"].tolist() == list(range(2 * BLOCK + 10))
    kept.close()


@pytest.mark.parametrize("in_memory", [0, 1 << 24])
@pytest.mark.parametrize("shape", [(), (5, 3)])
def test_all_records(monkeypatch, in_memory, shape):
    monkeypatch.setattr(records, "IN_MEMORY_BYTES", in_memory)
    kept = Records(np.dtype((np.float64, shape)))
    values = np.random.default_rng(3).normal(size=(BLOCK + 3, *shape))
    for value in values:
        kept.add(value)
    found = kept.all()
    del kept
    np.testing.assert_array_equal(found, values)
    found[:] = 0.0


def test_a_full_disk_is_said(monkeypatch):
    kept = Records(np.dtype([("n", "i8")]))

    class Full:
        def seek(self, _):
            pass

        def write(self, _):
            raise OSError(28, "No space left on device")

    kept.add((1,))
    kept._file = Full()
    with refused(TakeError, "take.no_working_space", error="os.enospc"):
        kept.read(0, 1)

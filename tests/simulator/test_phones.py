"""Pictures of phones: rows that are read one after the other, and frame rates that fall."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.simulator.landmarks.seen import SeenLandmarks, see_landmarks
from studio.simulator.landmarks.timing import PictureTiming
from studio.simulator.motion import stage_motion
from studio.simulator.rig import standard_rig
from tests.simulator.phones import READOUT_S, TIMINGS, errors_mm, seen_by


@pytest.fixture(scope="module")
def running(test_data: Path) -> CanonicalMotion:
    return stage_motion(test_data / "mocap" / "02_03.bvh", calibration=False)[0]


def test_rows_are_read_one_after_the_other(running: CanonicalMotion) -> None:
    rig = standard_rig(1)
    at_once, rolled = (
        next(see_landmarks(running, rig, seed=3, timing=PictureTiming(readout_s)))
        for readout_s in (0.0, 0.02)
    )
    off, row = [], []
    for a, b in zip(at_once.pictures, rolled.pictures, strict=True):
        if a is not None and b is not None:
            off.append(np.linalg.norm(a.pixels - b.pixels, axis=1))
            row.append(np.abs((a.pixels[:, 1] + 0.5) / at_once.lens.height - 0.5))
    far = np.array(row) > 0.3
    assert np.median(np.array(off)[far]) > 2.0 * np.median(np.array(off)[np.array(row) < 0.1])
    np.testing.assert_array_equal(at_once.device_time_ns, rolled.device_time_ns)


def test_a_slow_span_has_fewer_pictures_with_their_own_times(running: CanonicalMotion) -> None:
    rig = standard_rig(1)
    every = next(see_landmarks(running, rig, seed=3))
    some = next(see_landmarks(running, rig, seed=3, timing=PictureTiming(slow_s=((0.5, 1.5),))))
    kept = np.isin(every.device_time_ns, some.device_time_ns)
    slow = (every.taken_s >= 0.5) & (every.taken_s < 1.5)
    assert kept[~slow].all() and kept[slow].mean() == pytest.approx(0.4, abs=0.05)
    assert len(some.pictures) == len(some.taken_s) == kept.sum()


def test_a_known_readout_gives_the_accuracy_back(running: CanonicalMotion) -> None:
    at_once, rolled = (
        seen_by(running, 4, 1, TIMINGS[name]) for name in ("all rows at once, 30 Hz", "rows in 25 ms")
    )
    clean = errors_mm(running, at_once, "finish").mean()
    ignored = errors_mm(running, rolled, "finish").mean()
    known = errors_mm(running, rolled, "finish", readout_ms=1e3 * READOUT_S).mean()
    assert ignored > clean + 1.0
    assert known < clean + 0.6


@pytest.fixture(scope="module")
def steady_and_slow(running: CanonicalMotion) -> list[list[SeenLandmarks]]:
    """What two cameras see at a steady rate, and as both fall to 12 Hz at once."""
    timings = PictureTiming(), PictureTiming(slow_s=((0.7, 1.6),))
    return [seen_by(running, 2, 1, timing) for timing in timings]


@pytest.mark.parametrize(("solve", "most_mm"), [("studio", 10.0), ("finish", 4.0)])
def test_a_rate_that_falls_costs_little(
    running: CanonicalMotion, steady_and_slow: list[list[SeenLandmarks]], solve: str, most_mm: float
) -> None:
    """Live, that costs 5 to 11 mm (docs/experiments/rays.md)."""
    steady, slow = (errors_mm(running, seen, solve).mean() for seen in steady_and_slow)
    assert slow < steady + most_mm

"""A solve's trace is restored to half a millimetre, also through its file."""

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.model.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.whole_take.trace import STEP_M, Trace, TraceCollector
from tests.refused import refused


def result(rng: np.random.Generator, frame: int, cameras: tuple[str, ...]) -> StepResult:
    positions = rng.uniform(-3.0, 3.0, (len(cameras), JOINT_COUNT, 3))
    positions[rng.random((len(cameras), JOINT_COUNT)) < 0.2] = np.nan
    frames = FrameSet(
        frame * 16_666_667, cameras, positions, np.ones((len(cameras), JOINT_COUNT)), np.zeros((2, 3))
    )
    used = rng.random((len(cameras), JOINT_COUNT)) < 0.5
    reasons = {(c, j): "spike" for c in range(len(cameras)) for j in range(JOINT_COUNT) if not used[c, j]}
    fused = FusedSkeleton(
        np.nanmean(positions, axis=0), rng.random(JOINT_COUNT), np.ones(JOINT_COUNT), used, reasons
    )
    return StepResult(frames, fused, np.zeros((52, 3)), np.zeros((52, 4)), np.ones(52), np.ones(52))


@pytest.mark.filterwarnings("ignore:Mean of empty slice")
def test_what_goes_in_comes_out(tmp_path):
    rng = np.random.default_rng(0)
    results = [result(rng, frame, ("a", "b")) for frame in range(1500)]
    collector = TraceCollector()
    for each in results:
        collector.add(each)
    collector.trace().save(tmp_path / "trace.npz")
    trace = Trace.load(tmp_path / "trace.npz")
    assert trace.cameras == ("a", "b") and len(trace.time_ns) == 1500
    for frame in (0, 700, 1499):
        frames, fused = trace.inputs(frame)
        assert frames.stage_time_ns == results[frame].frame_set.stage_time_ns
        np.testing.assert_allclose(frames.positions, results[frame].frame_set.positions, atol=0.51 * STEP_M)
        np.testing.assert_allclose(fused.positions, results[frame].fused.positions, atol=0.51 * STEP_M)
        np.testing.assert_allclose(fused.confidence, results[frame].fused.confidence, atol=0.003)
        np.testing.assert_array_equal(fused.used, results[frame].fused.used)
        np.testing.assert_array_equal(np.array(trace.reasons)[trace.reason[frame]] == "spike", ~fused.used)


def test_cameras_may_come_in_another_order_and_go(tmp_path):
    rng = np.random.default_rng(1)
    collector = TraceCollector()
    collector.add(result(rng, 0, ("a", "b")))
    swapped = result(rng, 1, ("b", "c"))
    collector.add(swapped)
    frames, _ = collector.trace().inputs(1)
    assert np.isnan(frames.positions[0]).all()
    np.testing.assert_allclose(frames.positions[1], swapped.frame_set.positions[0], atol=0.51 * STEP_M)


def test_a_damaged_file_is_told(tmp_path):
    (tmp_path / "trace.npz").write_bytes(b"PK\x03\x04nothing")
    with refused(FormatError, "trace.damaged"):
        Trace.load(tmp_path / "trace.npz")

"""Clock estimation: offset and drift from exchanges with uneven delays, and combined models."""

import numpy as np
import pytest

from studio.engine.model.frames import ClockModel
from studio.engine.solve.timing.clock import ClockEstimator, chain, invert, shifted

SECOND = 1_000_000_000


def exchange(truth: ClockModel, server_ns: int, there_ns: int, back_ns: int) -> tuple[int, int, int, int]:
    """An exchange that reaches the server at `server_ns`, from a camera whose clock maps to it by `truth`."""
    to_device = invert(truth)
    send, reply = server_ns, server_ns + 30_000
    return (to_device.stage_ns(send - there_ns), send, reply, to_device.stage_ns(reply + back_ns))


@pytest.mark.parametrize("drift_ppm", [0.0, 100.0, -100.0])
def test_offset_and_drift_within_bounds_under_uneven_delays(drift_ppm):
    rng = np.random.default_rng(1)
    truth = ClockModel(offset_ns=-3 * 86_400 * SECOND, drift_ppm=drift_ppm, reference_ns=4 * 86_400 * SECOND)
    estimator = ClockEstimator()
    for second in range(60):
        there, back = 200_000 + rng.exponential(3e6, 2)
        sample = exchange(truth, 86_400 * SECOND + second * SECOND, int(there), int(back))
        assert estimator.add_exchange(*sample)
    now = sample[3]
    assert abs(estimator.model.stage_ns(now) - truth.stage_ns(now)) < 500_000
    assert abs(estimator.model.drift_ppm - drift_ppm) < 20


def test_drift_is_not_guessed_from_a_short_span():
    truth = ClockModel(offset_ns=5 * SECOND)
    estimator = ClockEstimator()
    for second in range(10):
        estimator.add_exchange(
            *exchange(truth, 100 * SECOND + second * SECOND, 100_000 + 90_000 * second, 100_000)
        )
    assert estimator.model.drift_ppm == 0.0
    assert abs(estimator.model.offset_ns - truth.offset_ns) < 100_000


def test_impossible_exchanges_are_refused():
    estimator = ClockEstimator()
    assert not estimator.add_exchange(100, 500, 400, 300)
    assert not estimator.add_exchange(100, 500, 900, 200)
    assert not estimator.add_exchange(0, 0, 0, 10 * SECOND)
    assert estimator.model is None


def test_arrivals_serve_until_the_first_exchange():
    estimator = ClockEstimator()
    estimator.add_arrival(1 * SECOND, 11 * SECOND + 40_000_000)
    estimator.add_arrival(2 * SECOND, 12 * SECOND + 10_000_000)
    estimator.add_arrival(3 * SECOND, 13 * SECOND + 90_000_000)
    assert estimator.model.offset_ns == 10 * SECOND + 10_000_000 and not estimator.exchanged
    estimator.add_exchange(*exchange(ClockModel(offset_ns=10 * SECOND), 14 * SECOND, 100_000, 100_000))
    estimator.add_arrival(4 * SECOND, 14 * SECOND + 1_000)
    assert estimator.exchanged and abs(estimator.model.offset_ns - 10 * SECOND) < 1_000


def test_a_clock_set_back_starts_anew():
    estimator = ClockEstimator()
    for second in range(40):
        estimator.add_exchange(*exchange(ClockModel(offset_ns=0), (100 + second) * SECOND, 100_000, 100_000))
    restarted = ClockModel(offset_ns=200 * SECOND)
    for second in range(2):
        estimator.add_exchange(*exchange(restarted, (205 + second) * SECOND, 100_000, 100_000))
    assert abs(estimator.model.offset_ns - restarted.offset_ns) < 1_000
    assert estimator.segment == 1 and abs(estimator.step_ns - 200 * SECOND) < 10_000_000


@pytest.mark.parametrize("step_ns", [-SECOND, -20_000_000, 20_000_000, 3600 * SECOND])
def test_a_jump_of_the_clock_begins_a_segment_within_two_exchanges(step_ns):
    estimator = ClockEstimator()
    before, after = ClockModel(offset_ns=5 * SECOND), ClockModel(offset_ns=5 * SECOND + step_ns)
    for second in range(40):
        estimator.add_exchange(*exchange(before, (4000 + second) * SECOND, 300_000, 900_000))
    for second in range(2):
        assert estimator.segment == 0
        estimator.add_exchange(*exchange(after, (4040 + second) * SECOND, 300_000, 900_000))
    assert estimator.segment == 1
    assert abs(estimator.model.offset_ns - after.offset_ns) <= estimator.error_ns
    assert abs(estimator.step_ns - step_ns) < 2_000_000


def test_one_wrong_exchange_and_slow_ones_are_no_jump():
    rng = np.random.default_rng(2)
    truth, estimator = ClockModel(offset_ns=5 * SECOND, drift_ppm=90.0), ClockEstimator()
    for second in range(120):
        there, back = 200_000 + rng.exponential(40e6, 2)
        estimator.add_exchange(*exchange(truth, (4000 + second) * SECOND, int(there), int(back)))
        if second == 60:
            estimator.add_exchange(*exchange(ClockModel(), 4061 * SECOND, 100_000, 100_000))
    assert estimator.segment == 0


@pytest.mark.parametrize(("there_ms", "back_ms"), [(20.0, 0.2), (0.2, 20.0), (5.0, 50.0)])
def test_the_error_by_uneven_ways_is_within_what_is_said(there_ms, back_ms):
    truth, estimator = ClockModel(offset_ns=-7 * SECOND, drift_ppm=-60.0), ClockEstimator()
    for second in range(90):
        sample = exchange(truth, (100 + second) * SECOND, int(there_ms * 1e6), int(back_ms * 1e6))
        estimator.add_exchange(*sample)
    error = abs(estimator.model.stage_ns(sample[3]) - truth.stage_ns(sample[3]))
    assert error <= estimator.error_ns + 100_000
    assert estimator.error_ns == pytest.approx((there_ms + back_ms) / 2 * 1e6, rel=0.01)
    assert abs(estimator.model.drift_ppm - truth.drift_ppm) < 5


def test_models_chain_invert_and_shift():
    a = ClockModel(offset_ns=7 * SECOND + 13, drift_ppm=80.0, reference_ns=1_000 * SECOND)
    b = ClockModel(offset_ns=-900 * SECOND, drift_ppm=-120.0, reference_ns=990 * SECOND)
    for time in (1_000 * SECOND, 1_600 * SECOND):
        assert abs(chain(a, b).stage_ns(time) - b.stage_ns(a.stage_ns(time))) <= 10
        assert abs(invert(a).stage_ns(a.stage_ns(time)) - time) <= 10
        assert shifted(a, 5).stage_ns(time) == a.stage_ns(time) + 5


def arrivals(estimator: ClockEstimator, offsets_ms: list[float], first: int = 0) -> None:
    """Frames 33 ms apart, each with its delay from stamp to arrival."""
    for k, offset_ms in enumerate(offsets_ms, first):
        estimator.add_arrival(k * 33_000_000, k * 33_000_000 + round(offset_ms * 1e6))


@pytest.mark.parametrize(("jump_ms", "needed"), [(-5000.0, 2), (3_600_000.0, 15)])
def test_arrivals_tell_that_a_clock_jumped(jump_ms, needed):
    estimator = ClockEstimator()
    arrivals(estimator, [1000.0 + k % 7 for k in range(30)])
    arrivals(estimator, [1000.0 + jump_ms + k % 7 for k in range(needed - 1)], 30)
    assert estimator.segment == 0 and estimator.model.offset_ns == 1_000_000_000
    arrivals(estimator, [1001.0 + jump_ms], 30 + needed)
    assert estimator.segment == 1
    assert abs(estimator.model.offset_ns * 1e-6 - 1000.0 - jump_ms) < 5.0
    assert abs(estimator.step_ns * 1e-6 - jump_ms) < 10.0


def test_a_link_that_was_held_up_is_no_jump():
    estimator = ClockEstimator()
    arrivals(estimator, [1000.0] * 30)
    arrivals(estimator, [1000.0 + 2000.0 - 33.0 * k for k in range(60)], 30)  # they all come at once
    arrivals(estimator, [1000.0] * 30, 90)
    assert estimator.segment == 0 and estimator.model.offset_ns == 1_000_000_000

"""Clock estimation: offset and drift out of exchanges with uneven delays, and models put together."""

import numpy as np
import pytest

from studio.engine.clock import ClockEstimator, chain, invert, shifted
from studio.engine.frames import ClockModel

SECOND = 1_000_000_000


def exchange(truth: ClockModel, server_ns: int, there_ns: int, back_ns: int) -> tuple[int, int, int, int]:
    """An exchange that reaches the server at `server_ns`, by a camera whose clock maps to it by `truth`."""
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
    estimator.add_exchange(*exchange(restarted, 205 * SECOND, 100_000, 100_000))
    assert abs(estimator.model.offset_ns - restarted.offset_ns) < 1_000


def test_models_chain_invert_and_shift():
    a = ClockModel(offset_ns=7 * SECOND + 13, drift_ppm=80.0, reference_ns=1_000 * SECOND)
    b = ClockModel(offset_ns=-900 * SECOND, drift_ppm=-120.0, reference_ns=990 * SECOND)
    for time in (1_000 * SECOND, 1_600 * SECOND):
        assert abs(chain(a, b).stage_ns(time) - b.stage_ns(a.stage_ns(time))) <= 10
        assert abs(invert(a).stage_ns(a.stage_ns(time)) - time) <= 10
        assert shifted(a, 5).stage_ns(time) == a.stage_ns(time) + 5

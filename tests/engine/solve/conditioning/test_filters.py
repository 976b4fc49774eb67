"""Filters over time, on signals with a known response; every filter keeps the same contract."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.settings.settings import FILTERS as FILTERS_BY_SETTINGS
from studio.engine.solve.conditioning.filters import FILTERS, Holt, OneEuro, RotationFilter

DT = 1 / 60


def run(inner, signal, dt=DT):
    return np.array([inner.apply(np.array(row, dtype=float), dt) for row in signal])


def rows(values):
    """A signal of rows with three values each."""
    return np.array(values, dtype=float)[:, None, None] * np.ones((1, 1, 3))


def test_the_registry_is_what_the_switch_offers():
    assert set(FILTERS) == set(FILTERS_BY_SETTINGS)


@pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)
class TestEveryFilter:
    def test_a_constant_passes(self, make):
        assert run(make(), rows([0.7] * 20)) == pytest.approx(rows([0.7] * 20))

    def test_the_first_frame_passes_and_a_step_is_reached(self, make):
        out = run(make(), rows([0.0] + [1.0] * 240))
        assert out[0] == pytest.approx(0.0)
        assert out[-1] == pytest.approx(1.0, abs=0.01)

    def test_noise_is_reduced(self, make):
        rng = np.random.default_rng(1)
        noise = rng.normal(0, 0.01, (600, 4, 3))
        out = run(make(), noise)
        assert out[60:].std() < 0.8 * noise.std()
        assert np.diff(out, axis=0).std() < 0.6 * np.diff(noise, axis=0).std()

    def test_an_unseen_row_passes_as_unseen_and_starts_anew_alone(self, make):
        signal = np.ones((30, 2, 3)) * np.arange(30)[:, None, None]
        spoiled = signal.copy()
        spoiled[10:15, 0] = np.nan
        inner, whole = make(), run(make(), signal)
        out = run(inner, spoiled)
        assert np.isnan(out[10:15, 0]).all()
        assert out[15, 0] == pytest.approx(15.0)
        assert out[:, 1] == pytest.approx(whole[:, 1]), "the other row does not notice"
        assert np.isfinite(out[15:]).all()

    def test_one_missing_number_does_not_last(self, make):
        signal = np.ones((30, 2, 3))
        signal[10, 0, 1] = np.nan
        assert np.isfinite(run(make(), signal)[12:]).all()

    def test_it_does_not_depend_on_where_the_origin_is(self, make):
        signal = np.random.default_rng(2).normal(0, 0.1, (50, 3, 3)).cumsum(axis=0)
        assert run(make(), signal + 5.0) == pytest.approx(run(make(), signal) + 5.0)

    def test_no_time_and_long_gaps_are_harmless(self, make):
        inner = make()
        for dt in (0.0, DT, 0.0, 10.0, 1e4, DT):
            assert np.isfinite(inner.apply(np.random.default_rng(1).normal(size=(2, 3)), dt)).all()

    def test_the_input_is_not_changed_nor_kept(self, make):
        inner, values = make(), np.ones((2, 3))
        inner.apply(values, DT)
        values[:] = 9.0
        assert inner.apply(np.ones((2, 3)), DT) == pytest.approx(1.0)


def test_holt_follows_a_ramp_without_lag():
    ramp = rows(np.arange(300) * 0.01)
    assert np.abs(run(Holt(), ramp) - ramp)[200:].max() < 1e-6


def test_holt_at_30_hz_is_the_textbook_recursion():
    signal = np.random.default_rng(3).normal(size=40)
    level, trend, expected = signal[0], 0.0, [signal[0]]
    for value in signal[1:]:
        new = 0.5 * value + 0.5 * (level + trend)
        trend = 0.5 * (new - level) + 0.5 * trend
        level = new
        expected.append(level)
    assert run(Holt(0.5, 0.5), rows(signal), dt=1 / 30)[:, 0, 0] == pytest.approx(np.array(expected))


def test_holt_smooths_alike_at_another_rate():
    def settled(hz):
        return run(Holt(), rows([0.0] + [1.0] * hz), dt=1 / hz)[hz // 3, 0, 0]

    assert settled(120) == pytest.approx(settled(60), abs=0.12)


def test_one_euro_is_smoother_when_slow_and_quicker_when_fast():
    rng = np.random.default_rng(4)
    still = rng.normal(0, 0.005, (400, 1, 3))
    slow = run(OneEuro(), still)[60:].std() / still.std()
    time = np.arange(120) * DT
    fast = rows(2.0 * time)
    lag_s = (fast - run(OneEuro(), fast))[-1, 0, 0] / 2.0
    assert slow < 0.6 and 0 <= lag_s < 0.03


def test_one_euro_without_speed_term_is_a_first_order_low_pass():
    out = run(OneEuro(min_cutoff_hz=1.0, beta=0.0), rows([0.0] + [1.0] * 60))[:, 0, 0]
    share = 1 / (1 + 1 / (2 * np.pi * 1.0 * DT))
    assert out == pytest.approx(1 - (1 - share) ** np.arange(61))


@pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)
def test_rotations_stay_rotations_and_do_not_care_for_the_sign(make):
    rng = np.random.default_rng(5)
    angles = np.linspace(0, 6 * np.pi, 400)  # thrice round: the quaternion changes its sign on the way
    q = Rotation.from_rotvec(angles[:, None] * [0, 0.6, 0.8]).as_quat(scalar_first=True)[:, None, :]
    flipped = q * rng.choice([-1.0, 1.0], (400, 1, 1))
    a, b = RotationFilter(make()), RotationFilter(make())
    for k, (one, other) in enumerate(zip(q, flipped, strict=True)):
        x, y = a.apply(one, DT), b.apply(other, DT)
        assert np.linalg.norm(x, axis=1) == pytest.approx(1.0)
        assert abs((x * y).sum()) == pytest.approx(1.0)
        assert abs((x * one).sum()) > np.cos(np.radians(15)), k

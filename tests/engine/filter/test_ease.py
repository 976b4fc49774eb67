import numpy as np
import pytest

from studio.engine.filter.ease import EASED, Ease


def test_a_correction_ahead_comes_in_evenly_until_its_time():
    ease = Ease(1)
    ease.go_on(1 / 60)
    ease.take(np.array([0.6]), 2 / 60)
    first = 0.6 - EASED * 0.4
    assert 0.6 + ease.left[0] == pytest.approx(first)
    ease.go_on(1 / 60)
    assert 0.6 + ease.left[0] == pytest.approx(0.5 * (first + 0.6))
    ease.go_on(1 / 60)
    assert ease.left[0] == pytest.approx(0.0)


@pytest.mark.parametrize("late_s", [0.0, -0.01])
def test_a_correction_of_the_past_comes_in_at_once(late_s):
    ease = Ease(1)
    ease.go_on(1 / 60)
    ease.take(np.array([0.6]), late_s)
    assert ease.left[0] == 0.0


def test_forgetting():
    ease = Ease(1)
    ease.go_on(1 / 60)
    ease.take(np.array([0.6]), 1 / 60)
    ease.forget()
    assert ease.left[0] == 0.0

"""The path of a joint through its pin, while the joint is unknown or partly wrong."""

import numpy as np
import pytest

from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.spread import NOISE_M, spread

COUNT, PIN = 150, 75
TIMES = STEP_S * np.arange(COUNT)
TRUE = np.stack([0.3 * np.sin(3.0 * TIMES), 0.2 * np.cos(2.0 * TIMES), 0.1 * np.sin(TIMES)], axis=1)
GONE = slice(60, 90)


def seen(*, cameras: int = 3) -> np.ndarray:
    rng = np.random.default_rng(4)
    return np.repeat(TRUE[:, None], cameras, axis=1) + 0.02 * rng.normal(size=(COUNT, cameras, 3))


def found(seen_m: np.ndarray):
    pinned = np.arange(COUNT) == PIN
    place = np.zeros((COUNT, 3))
    place[PIN] = TRUE[PIN] + [0.01, -0.01, 0.01]
    return spread(seen_m, pinned, place, np.ones(seen_m.shape[:2]))


def test_one_camera_of_three_errs_and_the_others_do_not():
    shown = seen()
    shown[GONE, 1] += [0.3, 0.0, 0.0]
    size = np.linalg.norm(found(shown).error_m, axis=2)
    assert (size[62:88, 1] > 0.2).all() and size[:, [0, 2]].max() < 3.0 * NOISE_M


def test_a_joint_that_nobody_sees_goes_through_its_pin():
    shown = seen()
    shown[GONE] = np.nan
    off = np.linalg.norm(found(shown).path_m - TRUE, axis=1)
    assert off[PIN] < 0.025 and off[GONE].max() < 0.1 and off[GONE].mean() < 0.05


@pytest.mark.parametrize("cameras", [1, 4])
def test_nothing_errs_where_the_pin_agrees(cameras):
    error = found(seen(cameras=cameras)).error_m
    assert np.linalg.norm(error, axis=2).max() < 0.08

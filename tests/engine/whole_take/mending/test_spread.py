"""A pin proves for how long cameras were wrong: on a joint whose true path is known."""

import numpy as np
import pytest

from studio.engine.whole_take.mending.around import STEP_S
from studio.engine.whole_take.mending.spread import NOISE_M, spread

COUNT, PIN = 150, 75
TIMES = STEP_S * np.arange(COUNT)
TRUE = np.stack([0.3 * np.sin(3.0 * TIMES), 0.2 * np.cos(2.0 * TIMES), 0.1 * np.sin(TIMES)], axis=1)
WRONG = slice(55, 100)


def seen(shift: np.ndarray, *, cameras: int = 3) -> np.ndarray:
    rng = np.random.default_rng(4)
    out = np.repeat(TRUE[:, None], cameras, axis=1) + 0.02 * rng.normal(size=(COUNT, cameras, 3))
    out[WRONG] += shift
    return out


def found(seen_m: np.ndarray, *, sound: float = 0.3):
    pinned = np.arange(COUNT) == PIN
    place = np.zeros((COUNT, 3))
    place[PIN] = TRUE[PIN] + [0.01, -0.01, 0.01]
    ones = np.ones(seen_m.shape[:2])
    return spread(seen_m, pinned, place, ones, sound * ones)


def test_a_shift_is_found_from_where_it_begins_to_where_it_ends():
    error = found(seen(np.array([0.15, 0.1, -0.1]))).error_m
    size = np.linalg.norm(error, axis=2)
    assert (size[WRONG] > 0.12).all()
    assert size[:54].max() < 0.05 and size[101:].max() < 0.05


def test_the_path_is_the_true_one_where_all_cameras_are_wrong():
    path = found(seen(np.array([0.0, 0.2, 0.0]))).path_m
    off = np.linalg.norm(path - TRUE, axis=1)
    assert off[WRONG].mean() < 0.035 and off.mean() < 0.03


def test_one_camera_of_three_errs_and_the_others_do_not():
    shown = seen(np.zeros(3))
    shown[WRONG, 1] += [0.3, 0.0, 0.0]
    size = np.linalg.norm(found(shown).error_m, axis=2)
    assert (size[60:95, 1] > 0.2).all() and size[:, [0, 2]].max() < 3.0 * NOISE_M


def test_a_joint_that_nobody_sees_goes_through_its_pin():
    shown = seen(np.zeros(3))
    shown[WRONG] = np.nan
    path = found(shown).path_m
    assert np.linalg.norm(path - TRUE, axis=1)[WRONG].max() < 0.06


@pytest.mark.parametrize("cameras", [1, 4])
def test_nothing_errs_where_the_pin_agrees(cameras):
    error = found(seen(np.zeros(3), cameras=cameras)).error_m
    assert np.linalg.norm(error, axis=2).max() < 0.08

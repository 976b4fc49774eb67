"""Names over the performers' heads: apart from one another where two stand close."""

from types import SimpleNamespace

import numpy as np
import pytest

from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.web.scene.performers.names import name_places


def standing(x, y=0.0, head_m=1.6):
    """A step of who stands there."""
    positions = np.zeros((len(OUTPUT_JOINTS), 3))
    positions[OUTPUT_INDEX["Head"]] = (x, y, head_m)
    return SimpleNamespace(positions_m=positions)


def test_names_of_two_who_stand_apart_are_over_their_heads():
    places = name_places({1: standing(0.0), 2: standing(1.5, head_m=1.5)})
    np.testing.assert_allclose(places[1], [0.0, 0.0, 1.87])
    np.testing.assert_allclose(places[2], [1.5, 0.0, 1.77])


@pytest.mark.parametrize("count", [2, 3, 8])
def test_names_of_who_stand_close_are_over_one_another(count):
    steps = {number: standing(0.05 * number, head_m=1.6 + 0.01 * number) for number in range(1, count + 1)}
    heights = sorted(float(place[2]) for place in name_places(steps).values())
    assert heights[0] < 1.9 and np.diff(heights).min() > 0.19


def test_names_part_little_by_little():
    heights = [name_places({1: standing(0.0), 2: standing(x)})[2][2] for x in np.linspace(0.4, 1.2, 81)]
    assert np.abs(np.diff(heights)).max() < 0.02 and heights[0] - heights[-1] == pytest.approx(0.2)


def test_who_has_no_pose_has_no_name():
    nobody = standing(np.nan)
    assert list(name_places({1: nobody, 2: standing(0.0)})) == [2]

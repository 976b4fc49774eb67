import numpy as np
import pytest

from studio.engine.edits.edit import PinEdit
from studio.engine.edits.honoured import refused
from studio.engine.edits.pins import SIGMA_M, Pins
from studio.engine.model.joints import INDEX, JOINT_COUNT

WRIST = INDEX["left_wrist"]
TIMES = np.arange(60) / 60


def pin(id_: str = "a", start_s: float = 0.5, end_s: float | None = None, **more) -> PinEdit:
    fields = {"joint": "left_wrist", "place_m": (1.0, 0.0, 1.0), **more}
    return PinEdit(id=id_, start_s=start_s, end_s=start_s if end_s is None else end_s, **fields)


def test_an_instant_is_one_of_the_nearest_frame():
    found = Pins([pin(start_s=0.505)]).at(TIMES, 1 / 60)
    assert np.flatnonzero(found.information.any(axis=1)).tolist() == [30]
    np.testing.assert_allclose(found.information[30, WRIST], SIGMA_M**-2)
    np.testing.assert_allclose(found.place_m[30, WRIST], (1.0, 0.0, 1.0))


def test_a_range_comes_and_goes():
    told = Pins([pin(start_s=0.4, end_s=0.6, ease_s=0.1)]).at(TIMES, 1 / 60).information[:, WRIST]
    assert (told[24:37] == told[30]).all() and told[:18].max() == 0.0 and told[43:].max() == 0.0
    assert (np.diff(told[18:25]) >= 0.0).all() and 0.0 < told[22] < told[30]


@pytest.mark.parametrize("begin_s", TIMES[::7].tolist())
def test_a_live_solve_is_told_the_same_as_finishing(begin_s):
    pins = Pins([pin(start_s=0.4, end_s=0.6), pin("b", 0.2, joint="head")])
    half = 0.5 / 60
    found = pins.between(begin_s - half, begin_s + half)
    every = pins.at(np.array([begin_s]), 1 / 60)
    if found is None:
        assert not every.information.any()
    else:
        np.testing.assert_allclose(found.information, every.information[0], atol=1e-6)


def test_within_its_radius_a_joint_is_free_and_outside_it_is_pulled_to_the_edge():
    pinned = Pins([pin(radius_m=0.1)]).at(np.array([0.5]), 1 / 60)
    sites = np.zeros((1, JOINT_COUNT, 3))
    sites[0, WRIST] = (1.05, 0.0, 1.0)
    assert not pinned.rows(sites)[0].any()
    sites[0, WRIST] = (1.3, 0.0, 1.0)
    told, away = pinned.rows(sites)
    assert told[0, WRIST] > 0
    np.testing.assert_allclose(away[0, WRIST], (-0.2, 0.0, 0.0))


def test_what_cannot_be_honoured_is_told_in_one_line_each():
    edits = [
        pin("tail", joint="tail"),
        pin("late", 99.0),
        pin("one", 0.3, place_m=(0.0, 0.0, 1.0)),
        pin("other", 0.3, place_m=(0.6, 0.0, 1.0)),
        pin("near", 0.3, place_m=(0.3, 0.0, 1.0)),
        pin("who", performer="performer_7"),
    ]
    found = refused(edits, cameras=["a"], performers=["performer_1"], span_s=(0.0, 10.0))
    assert {key: line.code for key, line in found.items()} == {
        "tail": "evidence.no_joint",
        "late": "evidence.outside",
        "one": "evidence.contradict",
        "other": "evidence.contradict",
        "who": "evidence.no_performer",
    }
    assert all("\n" not in line for line in found.values())

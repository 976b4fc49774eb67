"""Performers touch where an operator's edit says so: each moves half of the way."""

from typing import Any

import numpy as np
import pytest

from studio.engine.edits.edit import ContactEdit, Edit
from studio.engine.edits.touches import Touches
from studio.engine.model.joints import INDEX
from studio.engine.solve.touching import thick_m
from studio.engine.whole_take.finish.contact.between import held_by_others
from studio.engine.whole_take.finish.contact.others import Surfaces

DT = 1 / 60
HAND, SHOULDER = INDEX["left_hand"], INDEX["right_shoulder"]
HEIGHTS_M = {"performer_1": 1.8, "performer_2": 1.6}


@pytest.fixture
def surfaces() -> dict[str, Surfaces]:
    """Two performers, present for a second; the second one's frames are a little later, and begin late."""
    rng = np.random.default_rng(4)
    times = np.arange(60) * round(1e9 * DT)
    return {
        "performer_1": Surfaces(times, rng.normal(size=(60, 21, 3)), HEIGHTS_M["performer_1"]),
        "performer_2": Surfaces(times[20:] + 1000, rng.normal(size=(40, 21, 3)), HEIGHTS_M["performer_2"]),
    }


def touches(*edits: Edit) -> dict[str, Touches]:
    return {"performer_1": Touches(edits)}


def contact(**keys: Any) -> ContactEdit:
    told = {
        "joint": "left_hand",
        "touches": "right_shoulder",
        "other": "performer_2",
        "start_s": 0.2,
        "end_s": 0.7,
    }
    return ContactEdit(id="a", **{**told, **keys})


def test_both_give_way_until_their_surfaces_meet(surfaces: dict[str, Surfaces]) -> None:
    said = touches(contact())
    (mine,), (theirs,) = (held_by_others(name, surfaces, said) for name in HEIGHTS_M)
    assert (mine.joint, theirs.joint) == (HAND, SHOULDER)
    assert (mine.information > 0).nonzero()[0][[0, -1]].tolist() == [20, 47]  # none before the other is there
    assert (theirs.information > 0).nonzero()[0][[0, -1]].tolist() == [0, 27]
    here, there = surfaces["performer_1"].sites[20:, HAND], surfaces["performer_2"].sites[:, SHOULDER]
    met = slice(0, 28)
    apart = thick_m(HAND, 1.8) + thick_m(SHOULDER, 1.6)
    way = mine.place_m[20:][met] - theirs.place_m[met]
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), apart, atol=1e-9)
    middle = 0.5 * (mine.place_m[20:][met] + theirs.place_m[met])
    np.testing.assert_allclose(middle, 0.5 * (here + there)[met], atol=1e-9)


def test_what_is_no_contact_of_others_holds_nothing(surfaces: dict[str, Surfaces]) -> None:
    for edit in (
        contact(other=None), contact(other="performer_1"), contact(touches="floor"), contact(other="performer_9"),
        contact(start_s=3.0, end_s=4.0),
    ):  # fmt: skip
        assert not [one for name in HEIGHTS_M for one in held_by_others(name, surfaces, touches(edit))]
